"""Harsh families of loops: none wrong where the data determine the answer, hardly any withheld there.

Truth is certified roots of polynomials made of the exact doubles, written apart from the package, or by
construction. What 8 ulp of the entries change, the data do not determine: there any answer is allowed."""

import math
import warnings
from collections.abc import Iterator

import control
import numpy as np
import pytest
from flint import acb, ctx
from margin_families import PERIOD_S, integrators_and_whole_samples, near_the_limit, over_twelve_decades
from margin_truth import behind_delay, difference, polynomials, towards_the_limit, truth_of

from actuator_lti.margins import StabilityMargins, stability_margins
from tests.margins.differential import ALL, behind_part_of_a_sample, tried

ROUNDS = 24  # of each family, in all forms against the truth


@pytest.mark.parametrize("family", range(len(ALL)), ids=lambda k: f"{k}-{ALL[k].__name__}")
def test_one_answer_in_every_form(family: int, capfd: pytest.CaptureFixture[str]) -> None:
    wrong = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for k in range(ROUNDS):
            kind, what = tried(ALL[family], 2026, k * len(ALL) + family)
            if kind in ("wrong", "withheld"):  # withheld though the data determine it
                wrong.append((k, what))
    assert not wrong
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("family", range(len(ALL)), ids=lambda k: f"{k}-{ALL[k].__name__}")
def test_behind_part_of_a_sample_only_what_is_not_resolved_is_withheld(family: int) -> None:
    answers = [behind_part_of_a_sample(ALL[family], 2027, k * len(ALL) + family) for k in range(ROUNDS)]
    assert not [what for kind, what in answers if kind in ("wrong", "refused")]
    withheld = [what for kind, what in answers if kind == "withheld"]
    assert all("not resolved in double precision" in what for what in withheld)
    assert len(withheld) < ROUNDS // 2


def test_a_phase_that_turns_beside_poles_next_to_the_limit_is_followed() -> None:
    """A double pole at z = 1 that rounding parts by 1e-8: its rate hides the turn of the phase behind it."""
    k = 34747
    assert behind_part_of_a_sample(ALL[k % len(ALL)], 9201, k) == ("right", "")


@pytest.mark.parametrize(
    "k", [1001512, 1002322, 1002408, 1004031, 1004353, 1005110, 1005257, 1005639, 1005950]
)
def test_a_pole_that_rounding_carries_over_the_limit_is_not_said_to_be_on_it(k: int) -> None:
    loop = near_the_limit(np.random.default_rng([k, 2]))
    unstable = truth_of(loop).unstable
    assert truth_of(towards_the_limit(loop)).unstable != unstable  # so the data do not determine it
    for m in (stability_margins(loop), stability_margins(loop, certify=True)):
        assert m.evidence == "withheld" or m.agreement.unstable_poles == unstable
        assert not m.agreement.poles_at_limit
        if m.evidence == "withheld":
            assert "side of the stability limit" in m.evidence_reason
            assert m.agreement.unstable_poles is None


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_a_pole_at_rest_that_8_ulp_carry_over_the_limit_is_judged_alike_in_every_form(samples: int) -> None:
    """Random neighbours of the coefficients had all kept it on one side, those of the state space had not."""
    loop = integrators_and_whole_samples(np.random.default_rng([39005, 1871]))
    late = control.tf(loop.num[0][0], [*loop.den[0][0], *np.zeros(samples)], loop.dt)
    assert truth_of(towards_the_limit(late)).unstable != truth_of(late).unstable
    behind = (stability_margins(form, delay_s=samples * loop.dt) for form in (loop, control.ss(loop)))
    assert len({(m.stable, m.agreement.unstable_poles) for m in (stability_margins(late), *behind)}) == 1


@pytest.mark.parametrize(
    ("k", "use"), [(2000178, 1), (2000625, 1), (2002044, 1), (2001516, 1), (1002855, 2), (1006074, 2)]
)
def test_zeros_far_from_the_poles_hide_nothing(k: int, use: int) -> None:
    rng = np.random.default_rng([k, use])
    loop = over_twelve_decades(rng)
    m, answer = stability_margins(loop), truth_of(loop)
    assert difference(m, answer) is None
    v = np.array([0.0, *np.geomspace(1e-8, 1e8, 40_001)])  # a grid from above
    L = np.polyval(loop.num[0][0], 1j * v) / np.polyval(loop.den[0][0], 1j * v)
    assert m.modulus_margin <= np.abs(1.0 + L).min() * (1.0 + 1e-9)


def drawn(count: int) -> Iterator[tuple[control.TransferFunction, StabilityMargins]]:
    """Loops whose margins are told."""
    for seed in range(count):
        loop = integrators_and_whole_samples(np.random.default_rng([seed, 31]))
        if not (m := stability_margins(loop)).withheld:
            yield loop, m


def test_smallest_distances_are_not_undercut_on_a_grid() -> None:
    rng, compared = np.random.default_rng(7), 0
    for loop, m in drawn(60):
        top = math.pi / PERIOD_S if loop.dt else 1e4
        omega = np.exp(rng.uniform(math.log(1e-3), math.log(top), 600))
        num, den = polynomials(loop)
        with ctx.workprec(256):  # polynomials in z lose digits near z = 1
            points = [acb(0, w * PERIOD_S).exp() if loop.dt else acb(0, w) for w in omega]
            L = np.array([complex(num(p) / den(p)) for p in points])
        assert m.modulus_margin <= np.abs(1 + L).min() * (1 + 1e-9)
        assert m.disk_margin.alpha <= np.abs(2 * (1 + L) / (1 - L)).min() * (1 + 1e-9)
        compared += 1
    assert compared > 50


def test_delays_below_the_margin_keep_stability_and_above_it_end_it() -> None:
    """But where a gain only touches one, or passes it again near by: there the poles may return."""
    compared = 0
    for loop, m in drawn(320):
        quoted, crossovers = m.delay_margin, [p.frequency_rad_s for p in m.phase_margins]
        if loop.dt or not m.stable or quoted is None or any(p.tangent for p in m.phase_margins):
            continue
        if any(0.0 < abs(w / quoted.frequency_rad_s - 1) < 0.05 for w in crossovers):
            continue
        for part, unstable in ((0.05, 0), (0.5, 0), (0.98, 0), (1.01, 2)):
            delay_s = part * quoted.seconds
            late = stability_margins(loop, delay_s=delay_s)
            assert late.stable is (unstable == 0)
            assert behind_delay(loop, delay_s).unstable == unstable
            counted = {late.agreement.unstable_poles, late.agreement.unstable_nyquist}
            assert counted - ({None} if late.evidence == "certified" else set()) == {unstable}
        compared += 1
    assert compared > 25
