"""Harsh families of random loops, each a function of a generator: what an engine gets wrong."""

import math
from collections.abc import Callable

import control
import numpy as np

Loop = control.TransferFunction | control.StateSpace
PERIOD_S = 0.01


def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between two powers of ten."""
    return float(10.0 ** rng.uniform(low, high))


def signs(rng: np.random.Generator, negative: float) -> float:
    return -1.0 if rng.random() < negative else 1.0


def roots_of(
    rng: np.random.Generator, count: int, decades: float, damping: float = -2.0, wrong: float = 0.1
) -> list[complex]:
    """Single roots and pairs, ``wrong`` of them in the right half plane, damping from 10^damping to 1."""
    out: list[complex] = []
    while len(out) < count:
        w = uniform(rng, -0.5 * decades, 0.5 * decades)
        if len(out) == count - 1 or rng.random() < 0.4:
            out.append(complex(-w * signs(rng, wrong)))
            continue
        zeta = uniform(rng, damping, -0.05) * signs(rng, wrong)
        pair = w * complex(-zeta, math.sqrt(1.0 - zeta * zeta))
        out += [pair, pair.conjugate()]
    return out


def poly(roots: list[complex]) -> np.ndarray:
    return np.real(np.poly(np.array(roots))) if roots else np.array([1.0])


def scaled(
    rng: np.random.Generator, zeros: list[complex], poles: list[complex], sampled: bool, span: float = 2.0
) -> Loop:
    """num/den with a gain about one at a random frequency among the poles; z = exp(s T) where sampled."""
    size = np.abs([p for p in [*poles, *zeros] if p] or [1.0])
    x = uniform(rng, math.log10(size.min()) - 0.5, math.log10(size.max()) + 0.5)
    if sampled:
        x = min(x, 0.9 * math.pi / PERIOD_S)
        zeros, poles = ([complex(np.exp(PERIOD_S * r)) for r in part] for part in (zeros, poles))
    num, den = poly(zeros), poly(poles)
    at = np.exp(1j * x * PERIOD_S) if sampled else 1j * x
    size_there = abs(np.polyval(num, at) / np.polyval(den, at))
    gain = uniform(rng, -span, span) / size_there * signs(rng, 0.1)
    return control.tf(num * gain, den, PERIOD_S if sampled else 0)


def cascade(zeros: list[complex], poles: list[complex], gain: float) -> control.StateSpace:
    """Real state space in series of first and second order sections; gain about one somewhere."""

    def sections(roots: list[complex]) -> list[np.ndarray]:
        pairs = [poly([r, r.conjugate()]) for r in roots if r.imag > 0]
        return sorted(pairs + [poly([r]) for r in roots if r.imag == 0], key=len, reverse=True)

    whole, above = control.ss([], [], [], [[gain]]), sections(zeros)
    for den in sections(poles):
        k = next((i for i, f in enumerate(above) if len(f) <= len(den)), None)
        whole = control.tf2ss(above.pop(k) if k is not None else [1.0], den) * whole
    return whole


def state_space(
    rng: np.random.Generator, zeros: list[complex], poles: list[complex], sampled: bool, condition: float
) -> Loop:
    """The loop of `scaled` as a state space under a random similarity of a given condition."""
    whole = scaled(rng, zeros, poles, False)
    made = cascade(zeros, poles, float(whole.num[0][0][0] / whole.den[0][0][0]))
    n = made.nstates
    U, V = (np.linalg.qr(rng.standard_normal((n, n)))[0] for _ in range(2))
    T = U @ np.diag(np.geomspace(1.0, condition, n)) @ V
    parts = (T @ made.A @ np.linalg.inv(T), T @ made.B, made.C @ np.linalg.inv(T), made.D)
    loop = control.StateSpace(*parts, remove_useless_states=False)
    if not sampled:
        return loop
    period = 0.3 / max(float(np.abs(np.array(poles)).max()), 1e-3)
    held = control.c2d(loop, period)
    return control.StateSpace(held.A, held.B, held.C, held.D, period, remove_useless_states=False)


def orders_1_to_25(rng: np.random.Generator) -> Loop:
    n = int(rng.integers(1, 26))
    poles = roots_of(rng, n, 3.0)
    zeros = roots_of(rng, int(rng.integers(0, n)), 3.0)
    return state_space(rng, zeros, poles, bool(rng.random() < 0.5), 1.0)


def hardly_damped(rng: np.random.Generator) -> Loop:
    n = int(rng.integers(2, 9))
    zeros, poles = (roots_of(rng, count, 2.0, -6.0) for count in (int(rng.integers(0, n)), n))
    return scaled(rng, zeros, poles, rng.random() < 0.3)


def clusters_and_near_cancellations(rng: np.random.Generator) -> Loop:
    poles = roots_of(rng, int(rng.integers(1, 4)), 2.0, wrong=0.05)
    poles = poles * int(rng.integers(1, 4)) + roots_of(rng, 1, 2.0)
    zeros = roots_of(rng, int(rng.integers(0, 2)), 2.0)
    for p in roots_of(rng, 2, 2.0, wrong=0.0):
        moved = p * (1.0 + uniform(rng, -12.0, -2.0))
        poles.append(p)
        zeros.append(moved)
    return scaled(rng, zeros, poles, rng.random() < 0.3)


def up_to_four_integrators(rng: np.random.Generator) -> Loop:
    n, m = int(rng.integers(1, 5)), int(rng.integers(1, 5))
    poles = roots_of(rng, n, 2.0, wrong=0.0) + [0j] * m
    zeros = roots_of(rng, min(m - 1 + int(rng.integers(0, 2)), n + m - 1), 1.0, wrong=0.0)
    if rng.random() < 0.5:
        return scaled(rng, zeros, poles, rng.random() < 0.5)
    return state_space(rng, zeros, poles, bool(rng.random() < 0.5), 1.0)


def over_twelve_decades(rng: np.random.Generator) -> Loop:
    n = int(rng.integers(2, 9))
    poles, zeros = roots_of(rng, n, 12.0), roots_of(rng, int(rng.integers(0, n)), 12.0)
    return scaled(rng, zeros, poles, False, 6.0)


def unstable_with_high_gain(rng: np.random.Generator) -> Loop:
    n = int(rng.integers(2, 8))
    poles, zeros = roots_of(rng, n, 2.0, wrong=0.4), roots_of(rng, n - 1, 2.0, wrong=0.0)
    loop = scaled(rng, zeros, poles, rng.random() < 0.3)
    return control.tf(loop.num[0][0] * uniform(rng, 1.0, 8.0), loop.den[0][0], loop.dt)


def sampled_slowly_moving(rng: np.random.Generator) -> Loop:
    """Poles down to 1e-6 a sample, in modal blocks: the state space holds them to the last digit."""
    n = int(rng.integers(1, 4))
    A = np.zeros((2 * n, 2 * n))
    for k in range(n):
        w, zeta = uniform(rng, -6.0, -1.0), uniform(rng, -2.0, 0.0)
        p = np.exp(w * complex(-zeta, math.sqrt(1.0 - min(zeta, 0.999) ** 2)))
        A[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[p.real, p.imag], [-p.imag, p.real]]
    B, C = rng.standard_normal((2 * n, 1)), rng.standard_normal((1, 2 * n))
    return control.StateSpace(
        A, B * uniform(rng, -6.0, 0.0), C, [[0.0]], PERIOD_S, remove_useless_states=False
    )


def deadbeat_and_zeros_at_minus_one(rng: np.random.Generator) -> Loop:
    poles = [complex(rng.uniform(-0.9, 0.99)) for _ in range(int(rng.integers(1, 4)))]
    poles += [0j] * int(rng.integers(0, 6)) + [1 + 0j] * int(rng.integers(0, 3))
    zeros = [-1 + 0j] * int(rng.integers(0, min(len(poles), 3)))
    zeros += [complex(rng.uniform(-0.9, 0.99))] * int(rng.integers(0, len(poles) - len(zeros) + 1))
    num, den = poly(zeros), poly(poles)
    gain = uniform(rng, -2.0, 1.0) / abs(np.polyval(num, 1j) / np.polyval(den, 1j))
    return control.tf(gain * num, den, PERIOD_S)


def nearly_ill_posed(rng: np.random.Generator) -> Loop:
    """Biproper with 1 + L(infinity) down to 1e-13."""
    n = int(rng.integers(1, 6))
    poles, zeros = roots_of(rng, n, 2.0), roots_of(rng, n, 2.0)
    at_end = -1.0 + uniform(rng, -13.0, -1.0) * signs(rng, 0.5)
    if rng.random() < 0.3:
        poles, zeros = ([complex(np.exp(PERIOD_S * r)) for r in part] for part in (poles, zeros))
        return control.tf(at_end * poly(zeros), poly(poles), PERIOD_S)
    return control.tf(at_end * poly(zeros), poly(poles))


def badly_scaled_and_not_minimal(rng: np.random.Generator) -> Loop:
    n = int(rng.integers(2, 7))
    poles, zeros = roots_of(rng, n, 2.0), roots_of(rng, int(rng.integers(0, n)), 2.0)
    if rng.random() < 0.5:
        extra = roots_of(rng, 1, 2.0, wrong=0.0)
        poles, zeros = poles + extra, zeros + extra
    return state_space(rng, zeros, poles, bool(rng.random() < 0.5), uniform(rng, 1.0, 7.0))


def near_the_limit(rng: np.random.Generator) -> Loop:
    """A closed-loop pole pair 1e-5 to 1e-13 (relative) from the border: L at its gain margin, nearly."""
    w, more = uniform(rng, -1.0, 1.0), roots_of(rng, int(rng.integers(1, 4)), 1.0, wrong=0.0)
    shift = uniform(rng, -13.0, -5.0) * signs(rng, 0.5)
    closed = poly([complex(-shift * w, w), complex(-shift * w, -w), *more])
    poles = roots_of(rng, len(more) + 2, 1.0)
    den = poly(poles)
    return control.tf(closed - den, den) if abs(closed[1] - den[1]) > 1e-3 else near_the_limit(rng)


def integrators_and_whole_samples(rng: np.random.Generator) -> Loop:
    """Damping down to 1e-4, up to two integrators, sampled ones behind up to three samples."""
    sampled = rng.random() < 0.5
    poles = roots_of(rng, int(rng.integers(2, 9)), 3.0, -4.0, 0.12)
    poles += [0j] * int(rng.choice([0, 1, 2], p=[0.5, 0.4, 0.1]))
    zeros = roots_of(rng, int(rng.integers(0, len(poles))), 3.0, -4.0, 0.12)
    unit = 10.0 if sampled else 1.0
    loop = scaled(rng, [unit * r for r in zeros], [unit * r for r in poles], sampled)
    samples = int(rng.integers(0, 4)) if sampled else 0
    return control.tf(loop.num[0][0], np.append(loop.den[0][0], np.zeros(samples)), loop.dt)


def sections_permuted_and_scaled(rng: np.random.Generator) -> Loop:
    """State space in series of sections, its states permuted and scaled by powers of two up to 1e5 apart."""
    n, sampled = int(rng.integers(2, 9)), rng.random() < 0.5
    poles, zeros = (roots_of(rng, count, 1.1, -4.0, 0.12) for count in (n, int(rng.integers(0, n))))
    whole = scaled(rng, zeros, poles, False)
    if sampled:
        zeros, poles = ([complex(np.exp(0.1 * r)) for r in part] for part in (zeros, poles))
    made = cascade(zeros, poles, float(whole.num[0][0][0] / whole.den[0][0][0]))
    order, scale = rng.permutation(n), 2.0 ** rng.integers(-8, 9, n)
    A = (made.A * scale[:, None] / scale)[np.ix_(order, order)]
    parts = (A, (made.B * scale[:, None])[order], (made.C / scale)[:, order], made.D)
    return control.StateSpace(*parts, PERIOD_S if sampled else 0, remove_useless_states=False)


FAMILIES: tuple[Callable[[np.random.Generator], Loop], ...] = (
    orders_1_to_25,
    hardly_damped,
    clusters_and_near_cancellations,
    up_to_four_integrators,
    over_twelve_decades,
    unstable_with_high_gain,
    sampled_slowly_moving,
    deadbeat_and_zeros_at_minus_one,
    nearly_ill_posed,
    badly_scaled_and_not_minimal,
    near_the_limit,
    integrators_and_whole_samples,
    sections_permuted_and_scaled,
)
