"""Loops that a margin engine gets wrong (J1 to J7), truth by exact arithmetic."""

import math

import control
import numpy as np
import pytest
from margin_families import sampled_slowly_moving
from margin_truth import facts, truth_of, unlike

from actuator_lti.errors import InputError
from actuator_lti.margins import stability_margins

CERTIFY = [False, True]
PERIOD_S = 1e-3
SAMPLED = ([0.02, -0.019], [1, -2, 1])
REFERENCE = {
    "J1, a gain crossover far above the poles": control.tf([100, 2000], [1, 1e-6, 0]),
    **{f"J1, a double integrator of 1e{p}": control.tf([10.0**p, 10.0 ** (2 * p) / 3], [1, 0, 0])
       for p in range(-3, 13)},
    "J1, twelve decades above the pole": control.tf([1e12], [1, 1]),
    "J2, gain margins six decades apart": control.tf(10 * np.poly([-2, -2]), np.poly([-1e-6] * 3)),
    "J4, a sampled double integrator": control.tf(*SAMPLED, PERIOD_S),
    "J4, state space": control.ss(control.tf(*SAMPLED, PERIOD_S)),
    **{f"J5, poles at 1e-{p} that nothing cancels":
       control.tf([100, 2000], [1, 2 * 10.0**-p, 10.0 ** (-2 * p)]) for p in range(3, 10)},
}  # fmt: skip


@pytest.mark.parametrize("certify", CERTIFY)
@pytest.mark.parametrize("name", REFERENCE)
def test_the_reference_loops_have_the_margins_of_exact_rationals(name: str, certify: bool) -> None:
    m = stability_margins(REFERENCE[name], certify=certify)
    assert m.stable
    assert m.phase_margins
    assert unlike(facts(m), truth_of(REFERENCE[name]), far=1e20) is None


@pytest.mark.parametrize("certify", CERTIFY)
def test_J3_badly_scaled_and_unstable_not_on_the_border(certify: bool) -> None:
    A = [[-92.823, -95.026, -57.94, -92.24], [39.201, 32.857, 22.754, 49.85],
         [23.445, 33.729, 10.727, 6.496], [27.481, 25.66, 20.172, 29.942]]  # fmt: skip
    B = [84559.754, -33856.534, -37273.054, -19159.293]
    C = [36217.007, 20943.385, 19674.418, 84559.754]
    m = stability_margins(control.ss(A, np.array(B)[:, None], np.array(C)[None], 0), certify=certify)
    assert m.verdict == "unstable"
    assert m.agreement.unstable_poles == 2
    assert m.agreement.border_poles == 0


@pytest.mark.parametrize("certify", CERTIFY)
def test_J6_a_hidden_mode_at_zero_is_the_only_one_there(certify: bool) -> None:
    a, b = 16.10929513611608, 9.11073989162594
    A = [[0, a, 0], [-a, -6.4163624391599825, 0], [0, 1, 0]]
    loop = control.StateSpace(
        A, [[0], [b], [0]], [[0, 0, 9.110739891625938]], [[0]], remove_useless_states=False
    )
    m = stability_margins(loop, certify=certify)
    assert m.stable
    assert (m.agreement.unstable_poles, m.agreement.border_poles) == (0, 0)
    assert any("neither drives nor sees" in note for note in m.notes)


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


@pytest.mark.parametrize("certify", CERTIFY)
@pytest.mark.parametrize("form", ["transfer function", "state space"])
@pytest.mark.parametrize("samples", [2, 3, 4, 6, 8])
def test_J7_a_zero_of_the_loop_is_no_gain_margin(samples: int, form: str, certify: bool) -> None:
    loop = difference_over(samples, form)
    m = stability_margins(loop, certify=certify)
    zeros = [2 * math.pi * k / samples / PERIOD_S for k in range(1, samples // 2 + 1)]
    assert m.stable
    for gain in m.gain_margins:
        assert gain.ratio < 1e6
        assert all(abs(gain.frequency_rad_s / w - 1) > 1e-6 for w in zeros)
    assert m.gain_margins


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
    m = stability_margins(control.tf([1e-14], den, PERIOD_S))
    assert m.evidence == "withheld"
    assert "8 ulp" in m.evidence_reason
    assert (m.stable, m.verdict) == (None, "undecided")
    assert (m.gain_margin_db, m.phase_margin_deg, m.delay_margin_s, m.modulus_margin) == (None,) * 4
    assert "evidence: withheld" in str(m)
    late = stability_margins(control.tf([1e-14], den, PERIOD_S), delay_s=0.3 * PERIOD_S)
    assert late.evidence == "withheld"
    assert "8 ulp" in late.evidence_reason


def test_a_direct_feed_through_next_to_minus_one_is_well_posed_until_the_data_cannot_tell() -> None:
    for power in range(3, 14):
        m = stability_margins(control.tf([-1 + 10.0**-power, 1], [1, 2]))
        assert m.evidence == "certified" or power < 7
        assert m.agreement.unstable_poles == 0
    with pytest.raises(InputError, match="well posed"):
        stability_margins(control.tf([-1 + 1e-15, 1], [1, 2]))


@pytest.mark.parametrize("seed", range(24))
def test_slow_sampled_loops_keep_thirteen_digits(seed: int) -> None:
    loop = sampled_slowly_moving(np.random.default_rng([seed, 5]))  # poles down to 1e-6 a sample
    m, expected = stability_margins(loop), truth_of(loop)
    assert m.evidence != "withheld"
    result = [p.frequency_rad_s for p in m.phase_margins]
    assert result == pytest.approx([w for w, _ in expected.phases], rel=2e-14)
    assert [p.deg for p in m.phase_margins] == pytest.approx([deg for _, deg in expected.phases], abs=2e-12)
