"""A loop has one answer, however it is given and whatever delays are joined to it."""

import control
import numpy as np
import pytest
from scipy.optimize import brentq

from actuator_lti.margins import stability_margins
from actuator_lti.systems.delay_system import DelaySystem


@pytest.mark.parametrize("certify", [False, True], ids=["", "certified"])
@pytest.mark.parametrize("part", [1e-8, 1e-6, 1e-4, 0.005, 0.0087, 0.02])
def test_L6_a_small_part_of_a_sample(part: float, certify: bool) -> None:
    """0.4/(z + 0.5): a gain margin of 1.25 at Nyquist, and next to it as soon as there is a delay."""
    loop = control.tf([0.4], [1, 0.5], 1.0)
    for form in (loop, control.ss(loop)):
        m = stability_margins(form, delay_s=part, certify=certify)
        assert (m.stable, m.phase_margins) == (True, ())
        assert [g.ratio for g in m.gain_margins if g.ratio < 1e3] == pytest.approx([1.25], rel=1e-3)


@pytest.mark.parametrize("certify", [False, True], ids=["", "certified"])
def test_L12_a_gain_behind_a_delay(certify: bool) -> None:
    m = stability_margins(control.tf([0.5], [1]), delay_s=1.0, certify=certify)
    assert (m.stable, m.phase_margins) == (True, ())
    assert [g.ratio for g in m.gain_margins] == pytest.approx([2.0] * 6)


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
