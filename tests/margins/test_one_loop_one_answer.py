"""A loop has one answer, however it is given: reference loops with truth from exact rationals, and all forms.

The table's figures were computed apart from this package: closed-loop poles in 40 digits and exact rationals,
or the closed forms beside them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import control
import numpy as np
import pytest
from scipy.optimize import brentq

from actuator_lti.margins import StabilityMargins, stability_margins
from actuator_lti.systems.delay_system import DelaySystem

Z = control.tf([1, 0], [1], 1.0)


@dataclass(frozen=True)
class Case:
    """Ratios of the gain margins and degrees of the phase margins with |.| below 60 dB, as a whole list."""

    name: str
    given: Callable[[], control.LTI]
    stable: bool
    ratios: tuple[float, ...]
    deg: tuple[float, ...] | None = None
    delay_s: float = 0.0
    rel: float = 1e-5
    hidden: int = 0  # modes on the border that the loop does not show


def modes(zeta: float) -> control.StateSpace:
    w1, w2 = 100.3, 200.0
    A = [[0, w1, 0, 0], [-w1, 0, 0, 0], [0, 0, 0, w2], [0, 0, -w2, -2 * zeta * w2]]
    return control.ss(A, [[0], [1], [0], [1]], [[0, 10, 0, -1.8 * zeta * w2]], 0)


def modes_margin(zeta: float) -> tuple[float, ...]:
    """-1/L where the two modes of `modes` have opposite imaginary parts, by brentq on closed forms.

    The circle of the second mode has the same size at any damping: 0.963 dB at 2e-5 and at 2e-4 alike.
    """
    w1, w2, K = 100.3, 200.0, 10.0

    def L(w: float) -> complex:
        s = 1j * w
        return K * s / (s * s + w1 * w1) - 1.8 * zeta * w2 * s / (s * s + 2 * zeta * w2 * s + w2 * w2)

    w = w2 * (1.0 + zeta * np.linspace(-40.0, 40.0, 40_001))
    values = np.array([L(float(x)).imag for x in w])
    places = np.flatnonzero(np.diff(np.sign(values)) != 0)
    return tuple(-1.0 / L(brentq(lambda w: L(w).imag, w[k], w[k + 1], xtol=1e-13)).real for k in places)


def pi_on_zero() -> control.LTI:
    return control.tf([2, 1], [1, 0]) * control.tf([1, 0], [1, 3, 3, 1])


CASES = [
    Case("L1", lambda: control.tf([1.2], [1, -1], 1.0), False, (1 / 1.2,), delay_s=1.0),
    Case("L2", lambda: control.tf([0.1], [1, -1], 1.0), True, (10.0,), (81.4020,), delay_s=1.0),
    Case("L3", lambda: control.tf([0.4], [1, 0.5], 1.0), True, (2.5,), (), delay_s=1.0),
    Case(
        "L4",
        lambda: control.tf([5999.46, 1803600, 5400001080000, 1.62e15], [1, 0.6000000000000001, 9e8, 0, 0]),
        True, (1.1694, 20.46),
        rel=1e-3,
    ),
    Case("L5", lambda: modes(2e-5), True, modes_margin(2e-5)),
    Case("L5, tenfold damping", lambda: modes(2e-4), True, modes_margin(2e-4)),
    *(
        Case(f"L6, {q:g} of a sample", lambda: control.tf([0.4], [1, 0.5], 1.0), True, (1.25,), (), q, 1e-3)
        for q in (1e-8, 1e-6, 1e-4, 0.005, 0.0087, 0.02)
    ),
    Case(
        "L7",
        lambda: control.tf(
            [998.8603087726207, 1.460980729685113e-4, 44096.46617201614],
            [1, 1.1427147625307916e-6, 58.16523611839528, 1.75254191206914e-5, 140.91956726676923],
        ),
        True, (0.0226928, 0.204161),
    ),
    Case("L12", lambda: control.tf([0.5], [1]), True, (2.0,) * 6, (), delay_s=1.0),
    Case("L11, one", pi_on_zero, True, (), (141.2739,), hidden=1),
    Case("L11, two", lambda: pi_on_zero() * control.tf([2, 1], [1, 0]) * control.tf([1, 0], [1, 1]), True, (),
         (102.1151,), hidden=2),
    Case("L11, a pair", lambda: control.tf([1, 0, 4], np.polymul([1, 2, 1, 0], [1, 0, 4])), True, (2.0,),
         (21.38639,), hidden=2),
]  # fmt: skip


def near(m: StabilityMargins) -> list[float]:
    return [g.ratio for g in m.gain_margins if 1e-3 < g.ratio < 1e3]


@pytest.mark.parametrize("certify", [False, True], ids=["", "certified"])
@pytest.mark.parametrize("form", ["tf", "ss"])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_reference_loop(case: Case, form: str, certify: bool) -> None:
    loop = case.given()
    if form == "ss" and isinstance(loop, control.TransferFunction):
        if case.name == "L12":
            pytest.skip("a static gain has no states")
        loop = control.ss(loop)
    if form == "tf" and isinstance(loop, control.StateSpace):
        pytest.skip("given as a state space: its transfer function is another loop by rounding")
    m = stability_margins(loop, delay_s=case.delay_s, certify=certify)
    assert m.stable is case.stable
    assert near(m) == pytest.approx(list(case.ratios), rel=case.rel)
    if case.deg is not None:
        assert [p.deg for p in m.phase_margins] == pytest.approx(list(case.deg), abs=1e-3)
    if form == "tf":
        assert m.hidden_border_modes == case.hidden
        assert m.internally_stable is (case.stable and not case.hidden)
        assert any("neither drives nor sees" in note for note in m.notes) is bool(case.hidden)


@pytest.mark.parametrize("below", [1e-10, 5e-10])
def test_a_gain_that_all_but_reaches_one_is_a_touch_in_those_words(below: float) -> None:
    m = stability_margins(control.tf([0.2 * (1.0 - below), 0], [1, 0.2, 1]))
    assert m.stable
    assert not m.phase_margins or ("touch within 1e-9" in str(m) and m.phase_margins[0].tangent)


def test_no_gain_margin_at_rest_where_the_loop_is_zero_there() -> None:
    """s/(s + 1)^2 seen in states that a rotation mixes: c A^-1 b is rounding, of either sign."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        loop = control.ss(control.tf([-1.0, 0.0], [1.0, 2.5, 1.0]) * control.tf([1.0], [0.1, 1.0]))
        T = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        mixed = control.StateSpace(T @ loop.A @ T.T, T @ loop.B, loop.C @ T.T, loop.D)
        for delay_s in (0.0, 0.1):
            m = stability_margins(mixed, delay_s=delay_s)
            assert all(g.frequency_rad_s > 1e-3 for g in m.gain_margins)


@pytest.mark.parametrize("gain", [-0.4, 0.3, 0.9])
@pytest.mark.parametrize("den", [[1, 0.5], [1, -0.3, 0.1], [1, -0.9]])
def test_a_fraction_of_a_sample_goes_to_whole_samples(gain: float, den: list[float]) -> None:
    loop = control.tf([gain], den, 1.0)
    for whole in (0, 1):
        limit = stability_margins(loop, delay_s=float(whole)) if whole else stability_margins(loop)
        for q in [2e-8, 1e-6] if not whole else [1.0 - 2e-8, 1.0 + 2e-8, 1.0 - 1e-6]:
            m = stability_margins(loop, delay_s=q)
            assert m.stable is limit.stable
            assert m.agreement.unstable_poles is None  # the Nyquist curve alone tells
            assert [g.ratio for g in m.gain_margins] == pytest.approx(
                [g.ratio for g in limit.gain_margins], rel=1e-4
            )
            assert [p.deg for p in m.phase_margins] == pytest.approx(
                [p.deg for p in limit.phase_margins], abs=1e-3
            )


def test_small_coefficients_of_a_numerator_stay_where_a_delay_is_joined() -> None:
    """(1e-17 s + 1e-17)/(s^2 + 1e-9 s + 1e-16): python-control drops the numerator."""
    loop = control.tf([1e-17, 1e-17], [1.0, 1e-9, 1e-16])
    joined = DelaySystem.from_system(loop)
    w = 1j * np.geomspace(1e-9, 1e3, 25)
    exact = (1e-17 * w + 1e-17) / (w * w + 1e-9 * w + 1e-16)
    assert np.array([joined(s) for s in w]) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize(("gain", "poles", "delay_s"), [
    (3.0, (1.0, 3.0), 0.3212380417677561), (5.0, (1.0, 5.0), 0.02), (8.0, (2.0, 4.0), 0.9),
    (60.0, (2.0, 5.0), 0.05), (60.0, (2.0, 5.0), 0.01),
])  # fmt: skip
def test_two_integrators_that_cancel_behind_a_series_delay(
    gain: float, poles: tuple[float, float], delay_s: float
) -> None:
    """K s^2/(s^3 (s + a)(s + b)) exp(-s T): seen is K/(s (s + a)(s + b)), whose phase only falls."""
    a, b = poles
    loop = control.tf([gain, 0.0, 0.0], np.polymul([1.0, a + b, a * b], [1.0, 0.0, 0.0, 0.0]))
    w = brentq(lambda w: np.arctan(w / a) + np.arctan(w / b) + w * delay_s - 0.5 * np.pi, 1e-6, 100.0)
    ratio = w * np.hypot(w, a) * np.hypot(w, b) / gain
    for m in (
        stability_margins(loop, delay_s=delay_s),
        stability_margins(DelaySystem.from_system(loop) * DelaySystem.delay(delay_s)),
    ):
        assert m.stable is bool(ratio > 1.0)
        assert m.gain_margins[0].ratio == pytest.approx(ratio, rel=1e-9)
