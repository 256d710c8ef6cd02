"""Step figures on random systems over decades, against exact recursions and partial fractions."""

import math

import control
import numpy as np
import pytest
from step_truth import Continuous, recursion, sampled_figures, stable_poles, zeros

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.step import StepFigures, step_figures

J8 = control.tf(
    [0.000323883023900854, -0.0005365526764626962, 0.00021270496466312784],
    [1, -3.908959719441948, 5.728747002606614, -3.7305025810600734, 0.9107153332075087],
    0.001,
)


def companion(num: np.ndarray, den: np.ndarray, period_s: float) -> control.StateSpace:
    """The same system as state space, without a rounding (den[0] is one)."""
    n = den.size - 1
    full = np.concatenate((np.zeros(n + 1 - num.size), num))
    assert den[0] == 1.0
    assert full[0] == 0.0
    A = np.diag(np.ones(n - 1), -1)
    A[0] = -den[1:]
    b = np.eye(n)[:, :1]
    return control.StateSpace(A, b, full[None, 1:], [[0.0]], period_s, remove_useless_states=False)


def figures_or_reason(system: control.LTI) -> StepFigures | str:
    try:
        return step_figures(system)
    except (InputError, NumericalError) as error:
        return str(error)


def as_the_recursion_has_it(num: np.ndarray, den: np.ndarray, count: int, lost: bool = False) -> list[bool]:
    """Of a sampled system and its companion matrix the figures of the exact recursion; or why there are none.

    ``lost``: the gain at zero frequency is a rounding error of the coefficients.
    """
    y, final = recursion(num, den, count)
    truth, told = sampled_figures(y), []
    if abs(truth.last - 1.0) > 1e-3:
        return []  # it rings for longer than the truth was followed, or rounding has made it unstable
    for system in (control.tf(num, den, 1.0), companion(num, den, 1.0)):
        f = figures_or_reason(system)
        told.append(not isinstance(f, str))
        if isinstance(f, str):
            assert "zero within the rounding" in f
            assert lost or isinstance(system, control.StateSpace)
            continue
        assert f.rise_time_s == truth.rise
        assert f.settling_time_s == truth.settling
        assert f.overshoot_percent == pytest.approx(truth.overshoot_percent, rel=1e-8, abs=1e-6)
        assert f.final_value == pytest.approx(final, rel=1e-9)
    return told


def late(states: int) -> tuple[list[float], list[float]]:
    """0.9 y + 0.1 u - 0.002 y of so many samples ago."""
    return [0.1], [1.0, -0.9, *np.zeros(states - 2), 0.002]


SAMPLED = {
    "J8": (J8.num[0][0], J8.den[0][0]), "12 samples late": late(12), "40 samples late": late(40),
    "deadbeat": ([0.05, 0.75 - 0.05, 1.05 - 0.75, 1.0 - 1.05], [1.0, 0.0, 0.0, 0.0, 0.0]),
}  # fmt: skip


@pytest.mark.parametrize("name", SAMPLED)
def test_sampled_systems(name: str) -> None:
    assert as_the_recursion_has_it(*map(np.array, SAMPLED[name]), 6_000) == [True, True]
    assert name != "J8" or step_figures(J8).settling_time_s == pytest.approx(1.586, abs=1e-9)


def test_random_sampled_systems() -> None:
    rng, told = np.random.default_rng(8), []
    for _ in range(70):
        poles = stable_poles(rng, 8, True)
        den = np.real(np.poly(poles))
        num = np.real(np.poly(zeros(rng, len(poles) - 1, True))) * 10.0 ** rng.uniform(-3, 3)
        num = np.atleast_1d(num)
        count = min(int(60 / -math.log(max(*np.abs(poles), 0.1))) + 60, 6_000)
        final = num.sum() / den.sum()
        told += as_the_recursion_has_it(num, den, count, abs(final * den.sum()) < 1e-13 * np.abs(num).sum())
    assert told.count(True) >= 90
    assert told.count(False) <= 0.05 * told.count(True)


def as_partial_fractions_have_it(num: np.ndarray, den: np.ndarray) -> bool:
    """Of a continuous system the figures of its partial fractions; False where these are not told closely."""
    y = Continuous(num, den)
    poles = [complex(p) for p in y.poles]
    slow, fast = min(-p.real for p in poles), max(abs(p) for p in poles)
    gap = min((abs(a - b) for k, a in enumerate(poles) for b in poles[:k]), default=1.0)
    if gap < 1e-4 or 60.0 * fast / slow > 4e5:
        return False
    f, t = step_figures(control.tf(num, den)), np.linspace(0.0, 30.0 / slow, 200_001)
    seen = y.many(t)
    outside = np.flatnonzero((seen < 0.98) | (seen > 1.02))
    if outside.size:
        assert f.settling_time_s >= t[outside[-1]] * (1.0 - 1e-9)
        assert abs(abs(y(f.settling_time_s) - 1.0) - 0.02) < 1e-9
    else:
        assert f.settling_time_s <= t[1]
    later = f.settling_time_s + np.linspace(0.0, 1.0, 2001)[1:] * 8.0 / slow
    assert (np.abs(y.many(later) - 1.0) < 0.02 + 1e-9).all()
    assert f.overshoot_percent >= 100.0 * (seen.max() - 1.0) - 1e-7 * max(seen.max(), 1.0)
    if f.overshoot_percent:
        assert y(f.peak_time_s) == pytest.approx(1.0 + 0.01 * f.overshoot_percent, rel=1e-9)
    first = [t[max(int(np.argmax(seen >= level)) - 1, 0)] for level in (0.1, 0.9)]
    last = [t[int(np.argmax(seen >= level))] for level in (0.1, 0.9)]
    assert first[1] - last[0] - 1e-12 <= f.rise_time_s <= last[1] - first[0] + 1e-12
    return True


def beside_a_lag(*resonances: tuple[float, float]) -> control.TransferFunction:
    """1/(s + 1) and ``k s/(s^2 + 2 zeta w s + w^2)``: of each damping 1e-2 or 1e-3 the gain k and w."""
    s = control.tf("s")
    zeta = 1e-2 if len(resonances) == 1 else 1e-3
    return sum((k * s / (s**2 + 2 * zeta * w * s + w**2) for k, w in resonances), 1 / (s + 1))


CONTINUOUS = {
    **{f"a resonance {db:g} dB above the gain at rest": beside_a_lag((10.0 ** (db / 20.0), 50.0))
       for db in (80.0, 120.0, 160.0)},
    "two resonances that beat": beside_a_lag((4.0, 50.0), (4.0, 51.0)),
}  # fmt: skip


@pytest.mark.parametrize("name", CONTINUOUS)
def test_continuous_systems(name: str) -> None:
    system = CONTINUOUS[name]
    assert as_partial_fractions_have_it(system.num[0][0], system.den[0][0])


def test_random_continuous_systems() -> None:
    rng, compared = np.random.default_rng(9), 0
    for _ in range(60):
        poles = stable_poles(rng, 6, False)
        den = np.real(np.poly(poles))
        num = np.atleast_1d(np.real(np.poly(zeros(rng, len(poles), False)))) * 10.0 ** rng.uniform(-3, 3)
        compared += as_partial_fractions_have_it(num, den)
    assert compared >= 30


@pytest.mark.parametrize("zeta", [1e-3, 1e-5, 1e-7])
def test_light_damping(zeta: float) -> None:
    """(w/root) exp(-zeta w t): the last exit lies within half a period of where the envelope is 2 %."""
    f = step_figures(control.tf([100.0], [1.0, 20.0 * zeta, 100.0]))
    root = math.sqrt(1.0 - zeta**2)
    envelope = -math.log(0.02 * root) / (10.0 * zeta)
    assert envelope - math.pi / (10.0 * root) <= f.settling_time_s <= envelope
    assert f.overshoot_percent == pytest.approx(100.0 * math.exp(-math.pi * zeta / root), rel=1e-10)
    assert f.peak_time_s == pytest.approx(math.pi / (10.0 * root), rel=1e-9)


@pytest.mark.parametrize("order", [1, 3, 6, 10])
def test_repeated_poles(order: int) -> None:
    """1/(s + 1)^n: one minus the sum of Poisson probabilities, and the same sampled."""
    f = step_figures(control.tf([1.0], np.poly(-np.ones(order))))

    def y(t: float) -> float:
        return 1.0 - math.exp(-t) * sum(t**k / math.factorial(k) for k in range(order))

    assert y(f.settling_time_s) == pytest.approx(0.98, abs=1e-11)
    assert (f.overshoot_percent, f.peak_time_s) == (0.0, math.inf)
    g = step_figures(control.tf([0.5**order], np.poly(np.full(order, 0.5)), 1.0))
    values = [sum(math.comb(k - 1, order - 1) * 0.5**k for k in range(order, n + 1)) for n in range(200)]
    assert g.settling_time_s == next(n for n in range(200) if values[n] >= 0.98)


@pytest.mark.parametrize("apart", [1e-3, 1e-6, 1e-9])
def test_nearly_repeated_poles(apart: float) -> None:
    """1/((s + 1)(s + 1 + e)(s + 1 + 2 e)) tends to 1/(s + 1)^3."""
    f = step_figures(control.tf([1.0], np.poly([-1.0, -1.0 - apart, -1.0 - 2.0 * apart])))
    limit = step_figures(control.tf([1.0], [1.0, 3.0, 3.0, 1.0]))
    assert f.settling_time_s == pytest.approx(limit.settling_time_s, rel=3.0 * apart + 1e-9)


def test_a_gain_that_the_coefficients_do_not_hold_is_said() -> None:
    """Zeros about z = 1: the sum of the numerator's coefficients is a rounding error of theirs."""
    num = np.poly([1.0 + 1e-6] * 3)
    with pytest.raises((InputError, NumericalError), match=r"zero within the rounding|is zero:"):
        step_figures(control.tf(num, [1.0, -0.5, 0.0, 0.0], 0.001))


def test_an_unseen_mode_near_zero_frequency_does_not_matter() -> None:
    A = np.array([[0.5, 0.0], [1e-3, 1.0 + 2.0**-52]])
    for c in ([1.0, 0.0], [1.0, 1e-17]):
        system = control.StateSpace(A, [[0.5], [0.0]], [c], [[0.0]], 0.01, remove_useless_states=False)
        assert step_figures(system).settling_time_s == pytest.approx(0.06)
    angle = np.array([[-2.0, 0.0], [1.0, 0.0]])  # that nobody looks at
    system = control.StateSpace(angle, [[2.0], [0.0]], [[1.0, 0.0]], [[0.0]], remove_useless_states=False)
    assert step_figures(system).settling_time_s == pytest.approx(0.5 * math.log(50), rel=1e-9)


def test_samples_on_a_level_have_reached_it_and_on_the_band_are_inside() -> None:
    assert step_figures(control.tf([0.98, 0.02], [1.0, 0.0], 1.0)).settling_time_s == 0.0
    f = step_figures(control.tf([0.9], [1.0, -0.1], 1.0))  # 0.9, 0.99, ...
    assert (f.rise_time_s, f.settling_time_s) == (0.0, 2.0)
