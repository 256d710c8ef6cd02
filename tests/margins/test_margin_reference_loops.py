"""Loops a margin engine gets wrong (J1 to J7, L1 to L11), by exact arithmetic; published ones (A to G5)."""

import math
from fractions import Fraction

import control
import numpy as np
import pytest
from margin_families import sampled_slowly_moving
from margin_truth import facts, moved, truth_of, unlike

from actuator_lti.margins import stability_margins
from tests.refusals import refused

CERTIFY = [False, True]
PERIOD_S = 1e-3
SAMPLED = ([0.02, -0.019], [1, -2, 1])
TUSTIN = np.polymul([1, 1], [1, -0.3])
BADLY_SCALED = (
    [[-92.823, -95.026, -57.94, -92.24], [39.201, 32.857, 22.754, 49.85],
     [23.445, 33.729, 10.727, 6.496], [27.481, 25.66, 20.172, 29.942]],
    [[84559.754], [-33856.534], [-37273.054], [-19159.293]], [[36217.007, 20943.385, 19674.418, 84559.754]],
)  # fmt: skip
HIDDEN_ZERO = ([[0, 16.10929513611608, 0], [-16.10929513611608, -6.4163624391599825, 0], [0, 1, 0]],
               [[0], [9.11073989162594], [0]], [[0, 0, 9.110739891625938]])  # fmt: skip


def in_states(*parts: object) -> control.StateSpace:
    return control.StateSpace(*parts, [[0.0]], remove_useless_states=False)


def difference_over(samples: int, form: str) -> control.LTI:
    """0.2 (1 - z^-samples)/(1 - z^-1)/samples after a lag: zero at the multiples of 2 pi/samples."""
    num, den = 0.2 * np.ones(samples) / samples, np.polymul([1, -0.3], [1, *[0] * (samples - 1)])
    loop = control.tf(num, den, PERIOD_S)
    if form == "transfer function":
        return loop
    result = control.tf2ss(num, den)
    scale = np.random.default_rng(samples).uniform(0.5, 2.0, result.nstates)  # rounds each entry
    T, inverse = np.diag(scale), np.diag(1.0 / scale)
    T[0, -1], inverse[0, -1] = 0.3, -0.3 / (scale[0] * scale[-1])
    parts = (T @ result.A @ inverse, T @ result.B, result.C @ inverse, result.D)
    return control.StateSpace(*parts, PERIOD_S, remove_useless_states=False)


def modes(zeta: float) -> control.StateSpace:
    """Two modes, the second's circle of one size at any damping: 0.963 dB at 2e-5 and at 2e-4 alike."""
    w1, w2 = 100.3, 200.0
    A = [[0, w1, 0, 0], [-w1, 0, 0, 0], [0, 0, 0, w2], [0, 0, -w2, -2 * zeta * w2]]
    return control.ss(A, [[0], [1], [0], [1]], [[0, 10, 0, -1.8 * zeta * w2]], 0)


PI_ON_ZERO = control.tf([2, 1], [1, 0]) * control.tf([1, 0], [1, 3, 3, 1])
LOOPS = {
    "J1, a gain crossover far above the poles": control.tf([100, 2000], [1, 1e-6, 0]),
    **{f"J1, a double integrator of 1e{p}": control.tf([10.0**p, 10.0 ** (2 * p) / 3], [1, 0, 0])
       for p in range(-3, 13)},
    "J1, twelve decades above the pole": control.tf([1e12], [1, 1]),
    "J2, gain margins six decades apart": control.tf(10 * np.poly([-2, -2]), np.poly([-1e-6] * 3)),
    "J3, badly scaled and unstable": in_states(*BADLY_SCALED),
    "J4, a sampled double integrator": control.tf(*SAMPLED, PERIOD_S),
    "J4, state space": control.ss(control.tf(*SAMPLED, PERIOD_S)),
    **{f"J5, poles at 1e-{p} that nothing cancels":
       control.tf([100, 2000], [1, 2 * 10.0**-p, 10.0 ** (-2 * p)]) for p in range(3, 10)},
    "J6, a hidden mode at zero": in_states(*HIDDEN_ZERO),
    **{f"J7, a mean of {n} samples, {form}": difference_over(n, form)
       for n in (2, 3, 4, 6, 8) for form in ("transfer function", "state space")},
    "L1": control.tf([1.2], [1, -1], 1.0),
    "L2": control.tf([0.1], [1, -1], 1.0),
    "L3": control.tf([0.4], [1, 0.5], 1.0),
    "L4": control.tf([5999.46, 1803600, 5400001080000, 1.62e15], [1, 0.6000000000000001, 9e8, 0, 0]),
    "L5": modes(2e-5),
    "L5, tenfold damping": modes(2e-4),
    "L7": control.tf([998.8603087726207, 1.460980729685113e-4, 44096.46617201614],
                     [1, 1.1427147625307916e-6, 58.16523611839528, 1.75254191206914e-5, 140.91956726676923]),
    "L11, one": PI_ON_ZERO,
    "L11, two": PI_ON_ZERO * control.tf([2, 1], [1, 0]) * control.tf([1, 0], [1, 1]),
    "L11, a pair": control.tf([1, 0, 4], np.polymul([1, 2, 1, 0], [1, 0, 4])),
    "-199.969 dB on a flank, where the gain changes by half over 2e-6 of the frequency": control.tf(
        [176428.16345642603], [1.0, 1.3639956574524499, 90.6503255340668, 0.020975871825282644,
                               1.3937895453163396]),
    "a negative gain at rest": control.tf([-0.5], [1, 1]),
    "a negative feed-through": control.tf([-0.5, 1], [1, 2]),
    "a Tustin derivative, a pole at z = -1": control.tf([-0.05, 0.05], TUSTIN, 0.01),
    "the same, unstable": control.tf([0.05, -0.05], TUSTIN, 0.01),
    "a hidden unstable mode": in_states(np.diag([-2.0, 1.0]), [[3.0], [0.0]], [[1.0, 1.0]]),
}  # fmt: skip
LATE = {"L1": 1, "L2": 1, "L3": 1}  # behind so many samples
HIDDEN = {"L11, one": 1, "L11, two": 2, "L11, a pair": 2, "J6, a hidden mode at zero": 1}


@pytest.mark.parametrize("certify", CERTIFY)
@pytest.mark.parametrize("form", ["as it is", "in states"])
@pytest.mark.parametrize("name", LOOPS)
def test_a_loop_has_the_margins_of_exact_rationals(name: str, form: str, certify: bool) -> None:
    loop, late = LOOPS[name], LATE.get(name, 0)
    if form == "in states":
        if isinstance(loop, control.StateSpace):
            pytest.skip("it is")
        loop = control.ss(loop)
    m = stability_margins(loop, delay_s=late * float(loop.dt), certify=certify)
    expected, hidden = truth_of(loop, Fraction(late)), HIDDEN.get(name, 0)
    assert m.agreement.agree
    assert m.stable is (expected.unstable == 0)
    assert m.agreement.poles_at_limit == 0
    assert unlike(facts(m), expected, far=1e20) is None
    if form == "as it is":
        assert m.hidden_modes_at_limit == hidden
        assert m.internally_stable is (m.stable and not hidden)
        noted = any("neither drives nor sees" in note for note in m.notes)
        assert noted is bool(hidden) or not m.stable


def test_certify_is_certified_and_says_so() -> None:
    m = stability_margins(control.tf([25], [1, 10, 10, 10]), certify=True)
    assert m.evidence == "certified"
    assert "exact arithmetic" in m.evidence_reason
    assert "evidence: certified" in str(m)
    assert m.gain_margins[0].ratio == pytest.approx(3.6, rel=1e-15)
    assert stability_margins(control.tf([25], [1, 10, 10, 10])).evidence == "checked"


def test_what_8_ulp_decide_is_withheld() -> None:
    # a fourfold pole near z = 1: rounding of the coefficients scatters it by 1e-4
    den = np.poly([1 - 1e-4] * 4)
    m = stability_margins(control.tf([1e-15], den, PERIOD_S))
    assert m.evidence == "withheld"
    assert "not resolved in double precision" in m.evidence_reason
    assert (m.stable, m.verdict) == (None, "undecided")
    assert (m.gain_margin_db, m.phase_margin_deg, m.delay_margin_s, m.modulus_margin) == (None,) * 4
    assert "evidence: withheld" in str(m)
    loop, delay_s = control.tf([1.0], [1.0, -0.5], PERIOD_S), 0.3 * PERIOD_S
    limit = stability_margins(loop, delay_s).gain_margins[0].ratio
    late = stability_margins(limit * loop, delay_s)
    assert late.evidence == "withheld"
    assert "not resolved in double precision" in late.evidence_reason


def test_a_crossing_that_8_ulp_decide_is_that_of_the_doubles_and_noted() -> None:
    loop = control.tf([1e-13], np.poly([1 - 1e-4] * 4), PERIOD_S)
    m, near = stability_margins(loop), [moved(loop, np.random.default_rng(k)) for k in range(30)]
    assert m.verdict == "unstable"
    assert all(truth_of(other).unstable for other in near)
    assert len({0.0 in dict(truth_of(other).gains) for other in near}) == 2  # the sign of L(0) is not told
    assert any("whether L meets the real axis at w = 0 of the s-plane; listed as given" in n for n in m.notes)
    assert unlike(facts(m), truth_of(loop), 1e-6, 1e-3, far=30.0) is None


def test_a_direct_feed_through_next_to_minus_one_is_well_posed_until_the_data_cannot_tell() -> None:
    for power in range(3, 14):
        m = stability_margins(control.tf([-1 + 10.0**-power, 1], [1, 2]))
        assert m.evidence == "certified" or power < 7
        assert m.agreement.unstable_poles == 0
    refused(stability_margins, control.tf([-1 + 1e-15, 1], [1, 2]), words="well posed")


@pytest.mark.parametrize("seed", range(24))
def test_slow_sampled_loops_keep_thirteen_digits(seed: int) -> None:
    loop = sampled_slowly_moving(np.random.default_rng([seed, 5]))  # poles down to 1e-6 a sample
    m, expected = stability_margins(loop), truth_of(loop)
    assert m.evidence != "withheld"
    result = [p.frequency_rad_s for p in m.phase_margins]
    assert result == pytest.approx([w for w, _ in expected.phases], rel=2e-14)
    assert [p.deg for p in m.phase_margins] == pytest.approx([deg for _, deg in expected.phases], abs=2e-12)


s = control.tf("s")
A5 = 24 / (s**3 + 6 * s**2 + 11 * s + 6)
# loop, stable, gain margins (ratio, rad/s), phase margins (deg, rad/s); the digits of
# the reference cases, and beyond them those of mpmath at 40 digits
Margins = list[tuple[float, float]]
CASES: dict[str, tuple[control.LTI, bool, Margins, Margins]] = {
    "A1": (control.tf([25], [1, 10, 10, 10]), True, [(3.6, math.sqrt(10))], [(29.1103691304, 1.78443562083)]),
    "A2": (control.tf([0.04798, 0.0464], [1, -1.81, 0.9048], 0.1), True,
           [(2.05172413793, 5.43741315711), (2351.1389, 10 * math.pi)],
           [(178.135206307, 0.216923898705), (13.5711556361, 4.35435172073)]),
    "A3": (1 / (s * (s + 1) ** 2), True, [(2.0, 1.0)], [(21.3863897519, 0.682327803828)]),
    "A4": (1 / (s + 1) ** 3, True, [(8.0, math.sqrt(3))], []),
    "A5": (A5, True, [(2.5, math.sqrt(11))], [(35.4254199888, 2.06385145801)]),
    "A5 held 0.3 s": (control.c2d(control.ss(A5), 0.3), True, [(1.41205400689, 2.47750745166)],
                      [(18.6021379183, 2.04369751003)]),
    "A6": (8.75 * (4 * s**2 + 0.4 * s + 1)
           / ((100 * s + 1) * (s**2 + 0.22 * s + 1) * (s**2 / 100 + 0.008 * s + 1)), True,
           [(2.27158587032, 10.0052763665)],
           [(97.5939791371, 0.0850451549923), (-157.784483214, 0.937253347097),
            (134.732573654, 1.09191889152)]),
    "B2": (20e6 / (s * (s**2 + s + 1e6)), False, [(0.05, 1000.0)],
           [(89.9988531664, 20.0080096114), (87.1919002742, 989.858246607), (-87.0772800293, 1009.84124058)]),
    "C1": ((s**2 + 0.5 * s + 0.05) / s**3, True, [(0.1, 0.22360679775)], [(63.8424459348, 1.06498625116)]),
    "C2": (100 * (s + 1) ** 2 / (s**3 * (0.01 * s + 1) ** 2), True,
           [(10 ** (-45.666891702 / 20), 1.0206229413), (10 ** (5.66689170195 / 20), 97.9793770587)],
           [(19.7003049678, 68.2417391951)]),
    "C3": (1 / ((s + 3) * (s - 2)), False, [(6.0, 0.0)], []),
    "C5": (50 / (5 * s**3 + 10.25 * s**2 + 6.25 * s + 1), False,
           [(10 ** (-12.5325636564 / 20), 1.11803398875)], [(-35.0619805424, 2.02247263598)]),
    "E1": (control.tf([0.5], [1, -1], 0.001), True, [(4.0, 1000 * math.pi)],
           [(75.5224878141, 505.360510284)]),
    "E2 one delay": (control.tf([0.5], [1, 0], 0.001), True, [(2.0, 1000 * math.pi)], []),
    "E2 two delays": (control.tf([0.5], [1, 0, 0], 0.001), True, [(2.0, 500 * math.pi)], []),
    "E3": (control.tf([0.2], [1, -1, 0], 0.001), True, [(5.0, 1000 * math.pi / 3)],
           [(72.7824885682, 200.334842323)]),
    "G4 single": (10 / (s + 1) ** 3 * 3 / (s + 2) * 0.0119 * (1 + 1 / (0.849 * s)), True, [],
                  [(59.9865598482, 0.200068033621)]),
    "G4 inner": (3 / (s + 2) * 0.244 * (1 + 1 / (0.134 * s)), True, [], [(60.0051778568, 1.99965626152)]),
    "G5": (72 * 0.01 / ((0.01 * s + 0.1) * (0.5 * s + 1) + 0.0001), True, [],
           [(56.3562995942, 9.98998701494)]),
}  # fmt: skip


@pytest.mark.parametrize("in_states", [False, True], ids=["", "state space"])
@pytest.mark.parametrize("name", CASES)
def test_published_margins(name: str, in_states: bool) -> None:
    loop, stable, gains, phases = CASES[name]
    m = stability_margins(control.ss(loop) if in_states else loop)
    assert m.stable is stable
    assert m.agreement.agree
    if name == "G4 single":  # the source says nothing about its gain margin
        gains = [(g.ratio, g.frequency_rad_s) for g in m.gain_margins]
    assert [g.frequency_rad_s for g in m.gain_margins] == pytest.approx([w for _, w in gains], rel=1e-6)
    assert [g.ratio for g in m.gain_margins] == pytest.approx([k for k, _ in gains], rel=1e-6)
    assert [p.frequency_rad_s for p in m.phase_margins] == pytest.approx([w for _, w in phases], rel=1e-6)
    assert [p.deg for p in m.phase_margins] == pytest.approx([deg for deg, _ in phases], abs=1e-6)
    assert str(m).startswith("closed loop: stable" if stable else "closed loop: UNSTABLE")
    # the figures to quote: nearest to 0 dB, to 0 deg, the smallest delay
    db, deg = [20.0 * math.log10(k) for k, _ in gains], [deg for deg, _ in phases]
    delays = [math.radians(deg % 360.0) / w for deg, w in phases]
    assert [d.seconds for d in m.delay_margins] == pytest.approx(delays, rel=1e-6)
    assert [d.samples for d in m.delay_margins] == [
        d.seconds / loop.dt if loop.dt else None for d in m.delay_margins
    ]
    assert m.gain_margin_db == pytest.approx(min(db, key=abs, default=math.inf), abs=1e-5)
    assert m.phase_margin_deg == pytest.approx(min(deg, key=abs, default=math.inf), abs=1e-6)
    assert m.delay_margin_s == pytest.approx(min(delays, default=math.inf) if stable else 0.0, rel=1e-6)


def test_disk_margin_of_Seiler_Packard_Gahinet_2020_and_modulus_margins() -> None:
    a1, a3, a6 = (stability_margins(CASES[name][0]) for name in ("A1", "A3", "A6"))
    disk = a1.disk_margin
    assert [disk.alpha, a3.modulus_margin, a6.modulus_margin] == pytest.approx(
        [0.458092547742, 0.296988793339, 0.559084939016], rel=1e-9
    )
    assert [disk.deg, disk.db] == pytest.approx([25.8017, 4.0508], abs=1e-3)
    places = [disk.frequency_rad_s, a3.modulus_frequency_rad_s, a6.modulus_frequency_rad_s]
    assert places == pytest.approx([1.95502689534, 0.766612851992, 9.99184422487], rel=1e-6)


def test_D1_delay_margins_and_the_list_of_a_band() -> None:
    m = stability_margins(control.tf([100], [1, 0]), delay_s=0.005, band_rad_s=(0.0, 3000.0))
    first = 0.5 * math.pi / 0.005
    assert m.stable
    assert [g.frequency_rad_s for g in m.gain_margins] == pytest.approx(
        [first, 5 * first, 9 * first], rel=1e-9
    )
    assert m.gain_margin_db == pytest.approx(20 * math.log10(math.pi), abs=1e-9)
    assert m.phase_margin_deg == pytest.approx(61.3521102435, abs=1e-9)
    assert m.delay_margin_s == pytest.approx(10.7079632679e-3, rel=1e-9)
    assert m.band_rad_s == (0.0, 3000.0)


def test_printing_shows_units() -> None:
    text = str(stability_margins(CASES["A1"][0]))
    for part in ("dB", "deg", "rad/s", "Hz", "0.284724 s", "alpha 0.458093"):
        assert part in text
