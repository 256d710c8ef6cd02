"""Ends of the axis, tangencies, poles on the stability boundary, hidden modes, refusals."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design.access import with_values
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.loops import assemble_loops
from actuator_lti.margins import stability_margins
from actuator_lti.margins.axis_search import search
from actuator_lti.margins.factors_on_axis import Factored
from actuator_lti.margins.results import Agreement, StabilityMargins

s = control.tf("s")


def test_gain_touching_one_is_listed_as_touching() -> None:
    peak = 1 / (2 * 0.1 * math.sqrt(1 - 0.01))
    m = stability_margins(control.tf([1 / peak], [1, 0.2, 1]))
    (touch,) = m.phase_margins
    assert touch.tangent
    assert touch.frequency_rad_s == pytest.approx(math.sqrt(1 - 0.02), rel=1e-6)
    just_above = stability_margins(control.tf([(1 + 1e-7) / peak], [1, 0.2, 1]))
    assert [p.tangent for p in just_above.phase_margins] == [False, False]
    assert stability_margins(control.tf([(1 - 1e-7) / peak], [1, 0.2, 1])).phase_margins == ()


def test_curve_touching_the_negative_real_axis() -> None:
    def loop(
        damping: float,
    ) -> control.TransferFunction:  # a dip of the phase below the resonance of a dipole
        return (s**2 + 2 * damping * 1.2 * s + 1.44) / (s * (s + 4) * (s**2 + 2 * damping * s + 1))

    low, high = 0.01, 1.0  # crosses twice, not at all
    for _ in range(45):
        damping = math.sqrt(low * high)
        low, high = (damping, high) if crossings(loop(damping)) else (low, damping)
    pair = crossings(loop(low * (1 - 1e-6)))
    assert len(pair) == 2
    assert pair[1] / pair[0] - 1 < 1e-2
    assert crossings(loop(high * (1 + 1e-6))) == []
    (touch,) = stability_margins(loop(low)).gain_margins  # within 1e-9 of touching
    assert touch.tangent


def crossings(loop: control.TransferFunction) -> list[float]:
    return [g.frequency_rad_s for g in stability_margins(loop).gain_margins if g.frequency_rad_s > 0]


def test_dc_crossing_is_a_gain_margin() -> None:
    m = stability_margins(control.tf([-0.5], [1, 1]))
    (gain,) = m.gain_margins
    assert (gain.ratio, gain.frequency_rad_s) == (pytest.approx(2.0), 0.0)
    assert m.stable


def test_feedthrough_gives_a_margin_at_infinity() -> None:
    m = stability_margins(control.tf([-0.5, 1], [1, 2]))
    assert m.stable
    assert m.gain_margins[-1].frequency_rad_s == math.inf
    assert m.gain_margins[-1].ratio == pytest.approx(2.0)


@pytest.mark.parametrize(("gain", "stable"), [(-0.05, True), (0.05, False)])
def test_pole_at_z_minus_one(gain: float, stable: bool) -> None:
    loop = control.tf([gain, -gain], np.polymul([1, 1], [1, -0.3]), 0.01)  # a Tustin derivative
    assert bool((np.abs(np.roots(np.polyadd(loop.den[0][0], loop.num[0][0]))) < 1).all()) is stable
    for form in (loop, control.ss(loop)):
        m = stability_margins(form)
        assert m.agreement.agree
        assert m.stable is stable


def test_closed_loop_pole_on_the_border_is_not_stable() -> None:
    m = stability_margins(control.tf([1], [1, 0, 0]))
    assert m.stable is False
    assert m.verdict == "on the border"
    assert m.modulus_margin == pytest.approx(0.0, abs=1e-9)
    at_margin = stability_margins(control.tf([2], [1, 2, 1, 0]))  # A3 at its gain margin
    assert at_margin.stable is False
    assert at_margin.verdict == "on the border"


@pytest.mark.parametrize(
    "loop", [20 / (s**2 + 4), 5 * (s + 1) / (s * (s**2 + 9)), 3 * (s + 1) ** 2 / (s**2 + 1) ** 2]
)
def test_undamped_poles_on_the_axis_are_passed_on_the_right(loop: control.TransferFunction) -> None:
    values = np.roots(np.polyadd(loop.den[0][0], loop.num[0][0]))
    m = stability_margins(loop)
    assert m.agreement.agree
    assert (m.stable is True) == bool((values.real < -1e-9).all())


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_multiple_integrators_in_a_scrambled_state_space(order: int) -> None:
    rng = np.random.default_rng(order)
    loop = control.ss(control.tf(np.poly([-0.1] * (order - 1)) * 5, [1, *[0] * order]) * 8 / (0.001 * s + 1))
    Q = np.linalg.qr(rng.standard_normal((loop.nstates, loop.nstates)))[0]
    scrambled = control.ss(Q.T @ loop.A @ Q, Q.T @ loop.B, loop.C @ Q, loop.D)
    a, b = stability_margins(loop), stability_margins(scrambled)
    assert a.stable is True
    assert b.stable is True
    assert b.agreement.agree
    assert b.phase_margin_deg == pytest.approx(a.phase_margin_deg, abs=1e-4)


def test_an_integrator_that_the_loop_does_not_see_is_no_instability() -> None:
    A = np.array([[-2.0, 0.0], [1.0, 0.0]])  # speed, and the angle that nobody looks at
    m = stability_margins(
        control.StateSpace(A, [[3.0], [0.0]], [[1.0, 0.0]], [[0.0]], remove_useless_states=False)
    )
    assert m.stable
    assert any("neither drives nor sees" in note for note in m.notes)
    assert stability_margins(control.tf([3], [1, 2])).modulus_margin == pytest.approx(m.modulus_margin)


def test_a_hidden_unstable_mode_is_unstable() -> None:
    A = np.diag([-2.0, 1.0])
    m = stability_margins(
        control.StateSpace(A, [[3.0], [0.0]], [[1.0, 1.0]], [[0.0]], remove_useless_states=False)
    )
    assert m.stable is False


@pytest.mark.parametrize(
    ("loop", "message"),
    [
        (control.tf([1, 0, 1], [1, 1]), "improper"),
        (control.tf([-1, 1], [1, 2]), "well posed"),
        (control.ss([[np.nan]], [[1.0]], [[1.0]], [[0.0]]), "finite"),
        (control.ss(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2))), "one input"),
    ],
)
def test_refusals_say_why(loop: control.LTI, message: str) -> None:
    with pytest.raises(InputError, match=message):
        stability_margins(loop)


@pytest.mark.parametrize("delay_s", [-1.0, math.nan, math.inf])
def test_delay_has_to_be_a_length_of_time(delay_s: float) -> None:
    with pytest.raises(InputError, match="delay_s"):
        stability_margins(control.tf([1], [1, 1]), delay_s=delay_s)


def test_gain_of_one_everywhere_has_no_phase_margin() -> None:
    with pytest.raises(NumericalError, match="every frequency"):
        stability_margins(control.tf(np.polymul([-1, 1], [-1, 3]), np.polymul([1, 1], [1, 3])))


@pytest.mark.parametrize(
    ("gain", "stable", "ratio"), [(0.5, True, None), (-0.5, True, 2.0), (-2.0, True, 0.5)]
)
def test_a_loop_without_dynamics(gain: float, stable: bool, ratio: float | None) -> None:
    m = stability_margins(control.tf([gain], [1]))
    assert m.stable is stable
    assert m.modulus_margin == pytest.approx(abs(1 + gain))
    assert [g.ratio for g in m.gain_margins] == ([] if ratio is None else [ratio])


def test_disagreement_gives_no_figure() -> None:
    m = StabilityMargins(None, "undecided", (), (), (), None, None, None, None, 0.0, (0.0, math.inf), "",
                         Agreement(2, 0))  # fmt: skip
    assert m.withheld
    assert (m.gain_margin_db, m.phase_margin_deg, m.delay_margin_s, m.sensitivity_peak_db) == (None,) * 4
    assert "DISAGREE" in str(m)


def test_band_limits_the_lists_and_not_the_verdict() -> None:
    whole = stability_margins(control.tf([20e6], [1, 1, 1e6, 0]))
    part = stability_margins(control.tf([20e6], [1, 1, 1e6, 0]), band_rad_s=(1.0, 100.0))
    assert part.stable is whole.stable is False
    assert len(part.phase_margins) == 1
    assert part.modulus_margin == whole.modulus_margin


def test_unspecified_period_counts_as_one_second() -> None:
    m = stability_margins(control.tf([0.5], [1, 0], True))
    assert m.gain_margins[0].frequency_rad_s == pytest.approx(math.pi)


def test_on_the_border_is_what_lies_there_exactly() -> None:
    """k/(s (s + 1)^2) has poles at +-j for k = 2; the next double is no answer, 1e-12 away it is one."""
    answers = []
    for k in (2.0, np.nextafter(2.0, 3.0), np.nextafter(2.0, 1.0), 2.0 * (1 + 1e-12), 2.0 * (1 - 1e-12)):
        for certify in (False, True):
            m = stability_margins(control.tf([k], [1, 2, 1, 0]), certify=certify)
            answers.append((m.verdict, m.evidence == "withheld", m.agreement.border_poles))
    assert answers[:2] == [("on the border", False, 2)] * 2
    assert answers[2:6] == [("undecided", True, 0)] * 4
    assert answers[6:] == [("unstable", False, 0)] * 2 + [("stable", False, 0)] * 2


def test_the_sensitivity_of_an_unstable_loop_has_no_peak() -> None:
    """|S| on the axis is no gain there: nothing settles to it. One answer, for one design and for many."""
    design = load_design("ilr33-amber")
    gains = np.array([1.0, 40.0]) * design.parameters["control.position.gain"].value
    many = linear_figures(Population(design, {"control.position.gain": gains}, 2), time_figures=False)
    assert many.stable("position").tolist() == [True, False]
    peaks = many.quantity("sensitivity_peak", "position")
    distances = many.quantity("modulus_margin", "position")
    for k, gain in enumerate(gains):
        loop = assemble_loops(with_values(design, {"control.position.gain": gain})).present["position"]
        m = stability_margins(loop.open_loop)
        assert distances[k] == pytest.approx(m.modulus_margin, rel=1e-6)  # a distance it keeps
        if k == 0:
            assert peaks[k] == pytest.approx(m.sensitivity_peak_db, rel=1e-6)
            assert m.sensitivity_peak_db == pytest.approx(-20.0 * math.log10(m.modulus_margin))
        else:
            assert np.isnan(peaks[k])
            assert m.sensitivity_peak_db is None


@pytest.mark.parametrize("seed", range(12))
def test_pairs_that_are_double_but_for_rounding_make_no_crossing_at_nyquist(seed: int) -> None:
    """Delays of whole samples, poles at z = 0, are computed as pairs 1e-17 apart."""
    rng = np.random.default_rng(seed)
    real, apart = -(10.0 ** rng.uniform(-2.0, 2.0, 6)), 10.0 ** rng.uniform(-17.0, -13.0, 3)
    weights = np.repeat([1.0, -1.0, 1.0, -1.0], [3, 3, 2, 4])

    def crossings(sizes: np.ndarray) -> int:
        near = [complex(-1.0, side * size) for size in sizes for side in (1.0, -1.0)]
        factors = Factored(np.array([*real, *near]), weights, 0.0, phase=math.pi, slack=1e-8)
        return search(factors, 0.0, 1e3).real_w.size

    assert crossings(apart) == crossings(np.zeros(3))
