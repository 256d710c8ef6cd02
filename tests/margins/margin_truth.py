"""Crossovers and verdicts of rational loops from polynomial roots at high precision, for the tests only."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import control
import numpy as np
from mpmath import mp, mpc, mpf

from actuator_lti.margins import StabilityMargins

DIGITS = 50
MANY_DIGITS = 90
ULP = 8  # by how much the entries may be wrong
NEIGHBOURS = 6
EXACT = 900  # digits in which products of two dozen doubles are exact
ROUNDED = mpf(10) ** -700  # what is left of an exact zero where they are not
REAL = mpf(10) ** -22


@dataclass(frozen=True)
class Truth:
    """Frequencies (rad/s or angle of z), ratios and degrees, and unstable closed-loop poles."""

    gain_crossovers: list[float]
    phase_margins_deg: list[float]
    phase_crossovers: list[float]
    gain_margins: list[float]
    unstable: int
    nearest_to_border: float
    end_margins: list[float]  # at zero frequency and at the end of the axis


def polyval(p: list[mpf], x: mpc) -> mpc:
    out = mpc(0)
    for c in p:
        out = out * x + c
    return out


def product(factors: list[list[float]]) -> list[mpf]:
    """Polynomial product, exact at the working precision; highest power first."""
    with mp.workdps(EXACT):
        out = [mpf(1)]
        for factor in factors:
            out = multiply(out, [mpf(c) for c in factor])
        return out


def multiply(a: list[mpf], b: list[mpf]) -> list[mpf]:
    out = [mpf(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def subtract(a: list[mpf], b: list[mpf]) -> list[mpf]:
    n = max(len(a), len(b))
    a, b = [mpf(0)] * (n - len(a)) + a, [mpf(0)] * (n - len(b)) + b
    return [x - y for x, y in zip(a, b, strict=True)]


def divided(p: list[mpf], root: mpf) -> list[mpf]:
    out = [p[0]]
    for c in p[1:-1]:
        out.append(c + root * out[-1])
    return out


def roots(p: list[mpf]) -> list[mpc]:
    """All roots but -1: Aberth in double precision, then at high precision until 25 digits stand."""
    size = max(abs(c) for c in p)
    while p and abs(p[0]) <= size * ROUNDED:
        p = p[1:]
    at_zero = 0
    while len(p) > 1 and p[-1] == 0:
        p, at_zero = p[:-1], at_zero + 1
    with mp.workdps(EXACT):
        while len(p) > 1 and abs(polyval(p, -1)) <= size * ROUNDED:  # delays z^-q: multiple, not wanted
            p = divided(p, mpf(-1))
    n = len(p) - 1
    if n < 1:
        return [mpc(0)] * at_zero
    z = [mpc(complex(s)) for s in _estimates(p)]
    derivative = [c * (n - k) for k, c in enumerate(p[:-1])]
    for _ in range(100):
        worst = mpf(0)
        for k in range(n):
            newton = polyval(p, z[k]) / polyval(derivative, z[k])
            push = sum((1 / (z[k] - z[j]) for j in range(n) if j != k), mpc(0))
            step = newton / (1 - newton * push)
            z[k] -= step
            worst = max(worst, abs(step) / abs(z[k]))
        if worst < mpf(10) ** -26:
            return [*z, *[mpc(0)] * at_zero]
    raise AssertionError("the roots did not settle")


def _estimates(p: list[mpf]) -> np.ndarray:
    """Aberth in double precision, from circles whose radii the Newton polygon of the coefficients gives."""
    n = len(p) - 1
    logs = [float(mp.log(abs(c))) if c else -1e300 for c in reversed(p)]
    hull: list[int] = []
    for k in range(n + 1):
        while len(hull) > 1 and (logs[hull[-1]] - logs[hull[-2]]) * (k - hull[-1]) <= (
            logs[k] - logs[hull[-1]]
        ) * (hull[-1] - hull[-2]):
            hull.pop()
        hull.append(k)
    start = []
    for low, high in pairwise(hull):
        radius = np.exp((logs[low] - logs[high]) / (high - low))
        angles = 2 * np.pi * np.arange(high - low) / (high - low) + 0.7 + 0.3 * low
        start += list(radius * np.exp(1j * angles))
    z = np.array(start)
    centre = np.exp(np.mean(np.log(np.abs(z))))
    q = np.array([float(c / p[0] / mpf(centre) ** k) for k, c in enumerate(p)])
    z = z / centre
    derivative = np.polyder(q)
    for _ in range(60):
        with np.errstate(all="ignore"):  # roots over too many decades for doubles stay where they started
            newton = np.polyval(q, z) / np.polyval(derivative, z)
            gap = z[:, None] - z[None, :] + np.eye(n)
            step = newton / (1 - newton * ((1 / gap).sum(axis=1) - 1))
        step = np.where(np.isfinite(step), step, 0.0)
        z = z - step
        if (np.abs(step) < 1e-13 * np.abs(z)).all():
            break
    return z * centre * (1 + 1e-14 * np.arange(n))


def _positive_roots(p: list[mpf]) -> list[mpf]:
    return sorted(r.real for r in roots(p) if abs(r.imag) < REAL * abs(r) and r.real > 0)


def _at(num: list[mpf], den: list[mpf], point: mpc) -> mpc:
    return polyval(num, point) / polyval(den, point)


def exact_polynomials(loop: control.LTI) -> tuple[list[mpf], list[mpf]]:
    """Numerator and denominator of the very doubles (highest power first), by Faddeev and LeVerrier."""
    with mp.workdps(EXACT):
        if hasattr(loop, "num"):
            num, den = (np.trim_zeros(np.asarray(p[0][0]), "f") for p in (loop.num, loop.den))
            return [mpf(float(c)) for c in num], [mpf(float(c)) for c in den]
        A, unit = _integers(loop.A)
        b, unit_b = _integers(loop.B[:, 0])
        c, unit_c = _integers(loop.C[0])
        n = len(b)
        M, den_c, num_c = np.eye(n, dtype=int).astype(object), [1], []
        for k in range(1, n + 1):
            num_c.append(c @ M @ b)
            AM = A @ M
            last = -sum(AM[i, i] for i in range(n))
            assert last % k == 0
            den_c.append(last // k)
            M = AM + (last // k) * np.eye(n, dtype=int).astype(object)
        den = [mpf(int(x)) / mpf(unit) ** k for k, x in enumerate(den_c)]
        num = [mpf(0)] + [mpf(int(x)) / (mpf(unit) ** k * unit_b * unit_c) for k, x in enumerate(num_c)]
        num = [x + mpf(float(loop.D[0, 0])) * y for x, y in zip(num, den, strict=True)]
        while len(num) > 1 and num[0] == 0:
            num = num[1:]
        return num, den


def _integers(x: np.ndarray) -> tuple[np.ndarray, int]:
    ratios = [float(v).as_integer_ratio() for v in np.ravel(x)]
    unit = max(d for _, d in ratios)
    return np.array([a * (unit // d) for a, d in ratios], dtype=object).reshape(np.shape(x)), unit


def truth(num: list[mpf], den: list[mpf], sampled: bool, digits: int = DIGITS) -> Truth:
    """Everything of num/den (highest power first) under negative unit feedback."""
    with mp.workdps(EXACT):
        if sampled:
            degree = len(den) - 1
            num, den = bilinear(num, degree), bilinear(den, degree)
        gain, phase = _equations(num, den)
        ends = _end_margins(num, den)
    with mp.workdps(digits):
        gains = [mp.sqrt(v) for v in _positive_roots(gain)]
        phases = [mp.sqrt(v) for v in _positive_roots(phase)]

        def border(w: mpf) -> mpc:
            return mpc(0, w)

        def frequency(w: mpf) -> float:
            return float(2 * mp.atan(w) if sampled else w)

        degrees = [float(mp.degrees(mp.arg(-_at(num, den, border(x))))) for x in gains]
        real = [(x, _at(num, den, border(x)).real) for x in phases]
        real = [(x, L) for x, L in real if L < 0]
        closed = roots(subtract(den, [-c for c in num]))
        size = [p.real for p in closed]
        nearest = min((abs(p.real) / abs(p) for p in closed if p != 0), default=mpf(0))
        return Truth(
            [frequency(x) for x in gains], degrees, [frequency(x) for x, _ in real],
            [float(-1 / L) for _, L in real], sum(d > 0 for d in size), float(nearest), ends,
        )  # fmt: skip


def _end_margins(num: list[mpf], den: list[mpf]) -> list[float]:
    """-1/L where L is negative: at s = 0, and at infinity if there are poles at all."""
    pairs = [(num[-1], den[-1])]
    if len(den) > 1:
        pairs.append((num[0] if len(num) == len(den) else mpf(0), den[0]))
    return [float(-d / n) for n, d in pairs if n * d < 0]


def _split(p: list[mpf]) -> tuple[list[mpf], list[mpf]]:
    """p(j w) = even(v) + j w odd(v) with v = w^2; highest power first."""
    low = p[::-1]
    even = [c * (-1) ** k for k, c in enumerate(low[0::2])][::-1]
    odd = [c * (-1) ** k for k, c in enumerate(low[1::2])][::-1]
    return even or [mpf(0)], odd or [mpf(0)]


def _equations(num: list[mpf], den: list[mpf]) -> tuple[list[mpf], list[mpf]]:
    (ne, no), (de, do) = _split(num), _split(den)
    v = [mpf(1), mpf(0)]
    square_n = subtract(multiply(ne, ne), [-c for c in multiply(v, multiply(no, no))])
    square_d = subtract(multiply(de, de), [-c for c in multiply(v, multiply(do, do))])
    return subtract(square_n, square_d), subtract(multiply(no, de), multiply(ne, do))


def bilinear(p: list[mpf], degree: int) -> list[mpf]:
    """(1 - s)^degree p((1 + s)/(1 - s)), highest power first: the unit circle becomes the imaginary axis."""
    up, down = [[mpf(1)]], [[mpf(1)]]
    for _ in range(degree):
        up.append(multiply(up[-1], [mpf(1), mpf(1)]))
        down.append(multiply(down[-1], [mpf(-1), mpf(1)]))
    out = [mpf(0)]
    for k, c in enumerate(reversed(p)):
        out = subtract(out, [-c * x for x in multiply(up[k], down[degree - k])])
    return out


def difference(m: StabilityMargins, expected: Truth, period: float, rel: float) -> str | None:
    """What is wrong, or ``None``."""
    if m.stable is None:
        return f"withheld: {m.agreement}"
    if m.stable is (expected.unstable > 0):
        return f"verdict {m.verdict}, but {expected.unstable} unstable"
    expected = within_sight(expected)
    gains = [(g.frequency_rad_s * period, g.ratio) for g in m.gain_margins]
    end = math.pi * (1 - 1e-12) if m.period_s is not None else math.inf
    ends = [k for x, k in gains if not 0 < x < end]
    gains = [g for g in gains if 0 < g[0] < end]
    result = {
        "gain crossovers": ([p.frequency_rad_s * period for p in m.phase_margins], expected.gain_crossovers),
        "phase crossovers": ([w for w, _ in gains], expected.phase_crossovers),
        "gain margins": ([k for _, k in gains], expected.gain_margins),
        "gain margins at the ends": (ends, expected.end_margins),
    }
    for name, (ours, theirs) in result.items():
        if len(ours) != len(theirs) or not np.allclose(ours, theirs, rtol=rel, atol=0):
            return f"{name} {ours}, not {theirs}"
    degrees = [p.deg for p in m.phase_margins]
    if not np.allclose(degrees, expected.phase_margins_deg, rtol=0, atol=1e3 * rel):
        return f"phase margins {degrees}, not {expected.phase_margins_deg}"
    return None


def within_sight(a: Truth) -> Truth:
    """Without the crossings of the real axis with a margin above 200 dB, which are not listed."""
    real = [(x, k) for x, k in zip(a.phase_crossovers, a.gain_margins, strict=True) if k <= 1e10]
    return replace(
        a, phase_crossovers=[x for x, _ in real], gain_margins=[k for _, k in real],
        end_margins=[k for k in a.end_margins if k <= 1e10],
    )  # fmt: skip


def moved(loop: control.LTI, rng: np.random.Generator) -> control.LTI:
    """Each entry 8 ulp up or down."""

    def near(x: np.ndarray) -> np.ndarray:
        return x + ULP * np.spacing(np.abs(x)) * rng.choice([-1.0, 1.0], np.shape(x)) * (x != 0.0)

    if isinstance(loop, control.TransferFunction):
        return control.tf(near(loop.num[0][0]), near(loop.den[0][0]), loop.dt)
    parts = [near(np.asarray(part)) for part in (loop.A, loop.B, loop.C, loop.D)]
    return control.StateSpace(*parts, loop.dt, remove_useless_states=False)


def truth_of(loop: control.LTI) -> Truth:
    return truth(*exact_polynomials(loop), bool(loop.dt), MANY_DIGITS)


def same_facts(a: Truth, b: Truth) -> bool:
    lists = ((a.gain_crossovers, b.gain_crossovers), (a.phase_crossovers, b.phase_crossovers),
             (a.gain_margins, b.gain_margins), (a.end_margins, b.end_margins))  # fmt: skip
    return a.unstable == b.unstable and all(
        len(x) == len(y) and np.allclose(x, y, rtol=0.05, atol=0.0) for x, y in lists
    )


def towards_the_border(loop: control.TransferFunction) -> control.TransferFunction:
    """Each coefficient moved by 8 ulp so as to carry the closed-loop pole nearest to the border across."""
    num, den = exact_polynomials(loop)
    with mp.workdps(DIGITS):
        closed = subtract(den, [-c for c in num])
        slope = [c * (len(closed) - 1 - k) for k, c in enumerate(closed[:-1])]

        def outward(p: mpc, step: mpc) -> mpf:
            return (mp.conj(p) * step).real if loop.dt else step.real

        def distance(p: mpc) -> mpf:
            return abs(p) - 1 if loop.dt else p.real / abs(p)

        poles = [p for p in roots(closed) if p != 0 and polyval(slope, p) != 0]
        if not poles:
            return loop
        pole = min(poles, key=lambda p: abs(distance(p)))
        way = -1 if distance(pole) > 0 else 1

        def near(part: np.ndarray) -> np.ndarray:
            x = np.trim_zeros(np.asarray(part, dtype=float), "f")
            steps = [-(pole ** (x.size - 1 - k)) / polyval(slope, pole) for k in range(x.size)]
            up = np.array([1.0 if outward(pole, step) * way > 0 else -1.0 for step in steps])
            return x + ULP * np.spacing(np.abs(x)) * up * (x != 0.0)

        return control.tf(near(loop.num[0][0]), near(loop.den[0][0]), loop.dt)


def determined(loop: control.LTI, answer: Truth, rng: np.random.Generator) -> bool:
    """Whether neighbours 8 ulp away, random ones and the one most likely to differ, all have these facts."""
    near = [moved(loop, rng) for _ in range(NEIGHBOURS)]
    if isinstance(loop, control.TransferFunction):
        near.append(towards_the_border(loop))
    return all(same_facts(answer, truth_of(other)) for other in near)
