"""Ends of the axis, tangencies, poles on the stability boundary, hidden modes, refusals."""

import math

import control
import mpmath
import numpy as np
import pytest
from margin_families import clusters_and_near_cancellations, deadbeat_and_zeros_at_minus_one, orders_1_to_25
from margin_truth import difference, towards_the_limit, truth_of

from actuator_lti import load_design
from actuator_lti.bandwidth import closed_loop_bandwidth, peaks
from actuator_lti.batch import Population, linear_figures
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.loops import assemble_loops
from actuator_lti.margins import Agreement, StabilityMargins, stability_margins
from actuator_lti.step import step_figures
from actuator_lti.systems.delay_system import DelaySystem
from actuator_lti.systems.phase import unwrapped_phase_deg
from tests.changed import changed

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
    """A dip of the phase below the resonance of a dipole."""

    def loop(damping: float) -> control.TransferFunction:
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


@pytest.mark.parametrize(
    "loop", [20 / (s**2 + 4), 5 * (s + 1) / (s * (s**2 + 9)), 3 * (s + 1) ** 2 / (s**2 + 1) ** 2]
)
def test_undamped_poles_on_the_axis_are_passed_on_the_right(loop: control.TransferFunction) -> None:
    values = np.roots(np.polyadd(loop.den[0][0], loop.num[0][0]))
    m = stability_margins(loop)
    assert m.agreement.agree
    assert (m.stable is True) == bool((values.real < -1e-9).all())


BAND = r"^band_rad_s = .*: two frequencies, 0 <= low < high, in rad/s$"
NO_BANDS = ((1,), 5, ("a", "b"), "ab", "12", (2, 1), (1, 2, 3), (None, 1), (math.nan, 1))


@pytest.mark.parametrize(("loop", "asked", "message"), [
    (control.tf([1, 0, 1], [1, 1]), {}, "improper"),
    (control.tf([-1, 1], [1, 2]), {}, "well posed"),
    (control.tf([2, 1], [1, 5]), {"delay_s": 0.1}, "neutral"),
    (control.ss([[np.nan]], [[1.0]], [[1.0]], [[0.0]]), {}, "finite"),
    (control.ss(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2))), {}, "one input"),
    *((control.tf([1.0], [1.0, 1.0]), {"band_rad_s": band}, BAND) for band in NO_BANDS),
])  # fmt: skip
def test_refusals_say_why(loop: control.LTI, asked: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        stability_margins(loop, **asked)


def test_a_loop_beyond_double_precision_is_refused_without_a_warning() -> None:
    loop = control.tf([1e308], [1e-308, 1.0, 0.0])
    for figures in (stability_margins, closed_loop_bandwidth, step_figures):
        with pytest.raises(NumericalError, match="overflows double precision: rescale its coefficients"):
            figures(loop)


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


@pytest.mark.parametrize(("pole", "gain"), [(1.0, -0.5), (-1.0, -0.5), (0.5, 0.0)])
def test_a_mode_that_a_gain_behind_part_of_a_sample_does_not_show(pole: float, gain: float) -> None:
    """gain exp(-j w 0.03): real and negative at rest alone; of nothing there is no margin, and no peak."""
    loop = control.StateSpace([[pole]], [[0.0]], [[0.0]], [[gain]], 0.1, remove_useless_states=False)
    m = stability_margins(loop, delay_s=0.03)
    assert m.stable
    assert [(g.ratio, g.frequency_rad_s) for g in m.gain_margins] == ([(2.0, 0.0)] if gain else [])
    assert m.modulus_margin == pytest.approx(1.0 + gain)
    if not gain:
        assert stability_margins(control.tf([0.0], [1.0, 1.0]), delay_s=0.03, certify=True).stable
        assert unwrapped_phase_deg(loop, [1.0]) == [0.0]
        assert peaks(loop, 0.03) == peaks(loop)


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
            answers.append((m.verdict, m.evidence == "withheld", m.agreement.poles_at_limit))
            if m.verdict == "at the stability limit":
                assert (m.stable, m.modulus_margin) == (False, pytest.approx(0.0, abs=1e-9))
    assert answers[:2] == [("at the stability limit", False, 2)] * 2
    assert answers[2:6] == [("undecided", True, 0)] * 4
    assert answers[6:] == [("unstable", False, 0)] * 2 + [("stable", False, 0)] * 2


@pytest.mark.parametrize("k", [np.nextafter(2.0, 3.0), np.nextafter(2.0, 1.0), 2.0 - 1e-15])
def test_a_loop_that_is_unstable_in_any_case_is_said_to_be(k: float) -> None:
    """1 + L has the zeros of (s - 3) (s^3 + 2 s^2 + s + k): a pair on the axis for k = 2, and 3 for any k."""
    loop = control.tf([-2.0, -6.0, k - 4.0, -3.0 * k - 1.0], [1.0, 1.0, 1.0, 1.0, 1.0])
    for certify in (False, True):
        m = stability_margins(loop, certify=certify)
        assert (m.verdict, m.evidence) == ("unstable", "certified")
        assert difference(m, truth_of(loop)) is None
        told = {truth_of(near).unstable for near in (loop, towards_the_limit(loop))}
        assert len(told) == 2  # how many there are the data do not determine


@pytest.mark.parametrize(
    ("longer", "slope", "count"), [(1.0, 1e6, 2), (1e7, 1e6, 2), (1e11, 1e6, 1), (1.0, 1e-6, 1)]
)
def test_a_margin_at_rest_is_the_same_for_many_designs(longer: float, slope: float, count: int) -> None:
    """A load that pushes: at rest the velocity loop is negative, next to nothing where its integral is slow,
    and huge where the load hardly pushes. The margin there is listed within 200 dB, for one and for many.
    """
    design = load_design("ilr33-amber")
    time_s = design.controller.velocity.integral_time_s
    load = {"path": "back-drivable", "moment_slope_Nm_rad": slope}
    design = changed(design, load=load, controller={"velocity": {"integral_time_s": longer * time_s}})
    truth = truth_of(assemble_loops(design).present["velocity"].open_loop)
    assert len(truth.gains) == count
    found = linear_figures(Population(design, {}, 1), time_figures=False).phase_crossovers("velocity")
    assert found.margin[0][: found.crossings[0]] == pytest.approx([k for _, k in truth.gains], rel=1e-6)


FAR = {  # L/K, and K times its gain margin: within the axis and at both of its ends
    "three lags": (1 / (s + 1) ** 3, 8.0),
    "two samples": (control.tf([1], [1, 0, 0], 0.1), 1.0),
    "at rest": (-1 / (s + 1), 1.0),
    "at Nyquist": (control.tf([1], [1, 0.5], 0.1), 0.5),
}


@pytest.mark.parametrize("form", ["tf", "ss", "certified", "behind a delay"])
@pytest.mark.parametrize("db", [-285.0, -201.0, -199.0, 199.0, 201.0, 285.0])
@pytest.mark.parametrize("case", FAR)
def test_margins_beyond_200_db_are_counted_not_listed(case: str, db: float, form: str) -> None:
    """On both sides of one, in every form; behind one sample of delay against the explicit loop."""
    unit, ratio = FAR[case]
    gain = ratio / 10.0 ** (db / 20.0)
    loop = unit * gain
    if form == "ss":
        states = control.ss(unit)
        loop = control.ss(states.A, states.B, gain * states.C, gain * states.D, states.dt)
    if form == "behind a delay":
        if not loop.dt:
            pytest.skip("it crosses the axis without end")
        m = stability_margins(loop, delay_s=0.1)
        loop = control.tf(loop.num[0][0], np.append(loop.den[0][0], 0.0), 0.1)
    else:
        m = stability_margins(loop, certify=form == "certified")
    assert difference(m, truth_of(loop)) is None
    if form != "behind a delay":  # which has more crossings
        assert len(m.gain_margins) == (abs(db) < 200.0)
    if form in ("tf", "certified"):  # rounding makes more of the zeros that a state space has at infinity
        noted = [note for note in m.notes if "beyond 200 dB" in note]
        assert noted == [] if abs(db) < 200.0 else "1 crossing " in noted[0]


@pytest.mark.parametrize("certify", [False, True])
def test_a_band_may_be_any_pair(certify: bool) -> None:
    loop = control.tf([1.0], [1.0, 2.0, 1.0, 0.0])  # 1/(s (s + 1)^2): gain margin 2 at 1 rad/s
    for band in ([0.1, 10.0], np.array([0.1, 10.0]), (0.1, 10.0)):
        found = stability_margins(loop, band_rad_s=band, certify=certify)
        assert found.gain_margins[0].ratio == pytest.approx(2.0, rel=1e-12)
        assert found.band_rad_s == (0.1, 10.0)


def test_the_smallest_distance_is_found_at_a_resonance_that_few_places_show() -> None:
    """It crosses the unit circle 0.104 deg from -1: at least as near as 2 sin(0.052 deg)."""
    num = [13.549262580165, 0.0275907992797, 3066855.06404301, 15.2657139410679, 9278595.25856611]
    den = [1.0, 0.22308598193989, 82815.563419431, 18457.458636290, 412791.58121709, 91994.570914535, 0.0]
    m = stability_margins(control.tf(num, den))
    nearest = min(m.phase_margins, key=lambda p: abs(p.deg))
    bound = 2.0 * math.sin(0.5 * math.radians(abs(nearest.deg)))
    assert bound == pytest.approx(1.814e-3, rel=1e-3)
    assert 0.99 * bound < m.modulus_margin <= bound  # a resonance passes -1 as a straight line
    assert m.modulus_frequency_rad_s == pytest.approx(nearest.frequency_rad_s, rel=1e-6)


def test_the_smallest_distance_is_that_of_the_loop_where_its_factors_are_not_quite_the_loop() -> None:
    """Order 3, of zeros that matrices place to 1e-4: the modulus margin was 2.6e-7 above |1 + L| near by."""
    loop = orders_1_to_25(np.random.default_rng([3232, 500]))
    for sampled in (loop, control.c2d(loop, 0.01)):
        m = stability_margins(sampled)
        assert m.evidence == "checked"
        for place, value, distance in (
            (m.modulus_frequency_rad_s, m.modulus_margin, lambda L: np.abs(1.0 + L)),
            (
                m.disk_margin.frequency_rad_s,
                m.disk_margin.alpha,
                lambda L: 2.0 * np.abs((1.0 + L) / (1.0 - L)),
            ),
        ):
            w = place * (1.0 + np.linspace(-1e-4, 1e-4, 4001))
            L = sampled(np.exp(0.01j * w) if sampled.dt else 1j * w)
            assert value == pytest.approx(distance(L).min(), rel=1e-10)


@pytest.mark.parametrize(
    ("family", "loop"), [(deadbeat_and_zeros_at_minus_one, 3007), (clusters_and_near_cancellations, 3182)]
)
def test_a_smallest_distance_at_rest_is_that_of_the_coefficients(family, loop: int) -> None:
    """|1 + L(0)| of sums (sampled) or last coefficients: by the factors up to 4e-7 off."""
    system = family(np.random.default_rng([9, loop]))
    num, den = (part[0][0] for part in (system.num, system.den))
    rest = sum(num) / sum(den) if system.dt else num[-1] / den[-1]
    m = stability_margins(system)
    assert m.modulus_frequency_rad_s == 0.0
    assert m.modulus_margin == pytest.approx(abs(1.0 + rest), rel=1e-12)


@pytest.mark.parametrize("seed", [*range(10), 605, 717, 962, 1135])
def test_a_distance_next_to_nothing_has_its_digits(seed: int) -> None:
    """g/(s^2 + a s + b), of x = w^2: |1 + L|^2 has a minimum where a quadratic in x is zero."""
    rng = np.random.default_rng(seed)
    b = 10.0 ** rng.uniform(-4.0, 4.0)
    a, g = 2.0 * 10.0 ** rng.uniform(-7.0, -5.0) * b**0.5, b * 10.0 ** rng.uniform(-1.0, 1.0)
    m = stability_margins(control.tf([g], [1.0, a, b]))
    with mpmath.workdps(50):
        a, b, top = mpmath.mpf(a), mpmath.mpf(b), mpmath.mpf(b) + mpmath.mpf(g)
        p, q = a * a - 2 * top, a * a - 2 * b
        half, whole = (b * b - top * top) / (q - p), (p * b * b - q * top * top) / (q - p)
        x = -half + mpmath.sqrt(half * half - whole)
        smallest = mpmath.sqrt((x * x + p * x + top * top) / (x * x + q * x + b * b))
    assert m.modulus_margin == pytest.approx(float(smallest), rel=1e-9)


def test_a_loop_of_hundreds_of_states_that_double_precision_does_not_place_is_withheld_at_once() -> None:
    """A pole at z = 1 but for rounding, and 250 states: exact arithmetic would take minutes."""
    n = 250
    A = np.diag(np.full(n - 1, 1.0), -1)
    A[0, -1] = 1.0 + 2.0**-52  # poles on the circle all round, to rounding
    loop = control.StateSpace(A, np.eye(n)[:, :1], 0.5 * np.eye(n)[-1:], [[0.0]], 0.1)
    m = stability_margins(loop, certify=True)
    assert (m.stable, m.evidence) == (None, "withheld")
    assert "exact arithmetic decides up to 200 states, these are 250" in m.evidence_reason


def test_a_gain_margin_at_rest_has_its_digits_where_states_that_are_0_there_weigh_more() -> None:
    """L(0) = num[-1]/den[-1], 179.5 dB from -1: rounding of a derivative that is 0 was 5e-5 of it."""
    num = [4.12934957e10, 1.34229615e6, 2.94665573e3]
    den = [1.0, 2.67107570e3, 8.00878945e7, 1.80697861e10, -2.77795264e12]
    series = DelaySystem.from_system(control.tf(num, den)) * DelaySystem.delay(1e-3)
    ratios = [g.ratio for g in stability_margins(series).gain_margins if g.frequency_rad_s == 0.0]
    assert ratios == [pytest.approx(2.77795264e12 / 2.94665573e3, rel=1e-12)]


def test_zeros_far_slower_than_the_poles_are_those_of_the_loop() -> None:
    """A slow pair of zeros that matrices place only to some digits: the crossing beside them was lost."""
    num = [1.49976e20, 3.49879e18, 6.86855e13, 3.83488e11]
    den = [1.0, 6.88842e5, 5.92257e10, 1.32449e16, 6.79649e15, 5.49615e17]
    late = 3.74872e-6

    def response(w: mpmath.mpf) -> mpmath.mpc:
        p = mpmath.mpc(0.0, w)
        return np.polyval(num, p) / np.polyval(den, p) * mpmath.exp(-late * p)

    with mpmath.workdps(40):
        at = mpmath.findroot(lambda w: mpmath.im(response(w)), 6.8e-4)
        ratio = -1.0 / mpmath.re(response(at))
    system = control.tf(num, den)
    for m in (
        stability_margins(system, late, (0.0, 1.0)),
        stability_margins(DelaySystem.from_system(system) * DelaySystem.delay(late), 0.0, (0.0, 1.0)),
    ):
        (margin,) = m.gain_margins
        assert (margin.frequency_rad_s, margin.ratio) == pytest.approx((float(at), float(ratio)), rel=1e-6)


@pytest.mark.parametrize("inside", [False, True])
def test_a_loop_with_a_hundred_samples_of_delay_as_states_is_checked(inside: bool) -> None:
    """Its chain is one defective pole at z = 0, and zeros at infinity; ``inside``: within an inner loop."""
    samples, gain, inner = 100, 2.0**-9, 2.0**-9
    n = samples + 2
    A = np.eye(n, k=-1)
    A[0, 0] = A[-1, -1] = 1.0  # an integrator, the chain, another integrator
    A[0, samples] = -inner * inside
    b, c = np.eye(n)[:, :1], gain * inner * np.eye(n)[-1:]
    if not inside:
        A, b, c = A[:-1, :-1], b[:-1], 0.5 * gain * np.eye(n - 1)[-1:]
    den = np.zeros(samples + 2)
    den[:2], den[-1] = (1.0, -1.0), inner * inside
    expected = truth_of(control.tf([c.max()], np.polymul(den, [1.0, -1.0]) if inside else den, 1.0))
    m = stability_margins(control.StateSpace(A, b, c, [[0.0]], 1.0))
    assert m.evidence == "checked"
    assert difference(m, expected) is None
