"""A design of healthy margins that diverges behind a limit: the validator finds it and says so."""

from dataclasses import replace
from math import degrees, inf, pi
from pathlib import Path

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.design.model import Design
from analyses.large_signal.conditional import (
    Conditional,
    conditional_stability,
    saturation_gain,
    saturation_ratio,
    step_threshold,
)
from analyses.large_signal.tones import settling_ticks_of
from analyses.validation import QUICK, validate
from nonlinear import commands, simulate
from reports.sections.beyond import large_commands as section

FILE = Path(__file__).with_name("conditional.toml")


def look(design: Design) -> Conditional:
    loops = assemble_loops(design)
    settle = settling_ticks_of(loops.position.closed_loop, design.controller.position.every, design.name)
    return conditional_stability(design, loops, settle)


@pytest.fixture(scope="module")
def conditional() -> Conditional:
    return look(load_design(str(FILE)))


def test_the_margins_are_healthy() -> None:
    for loop in assemble_loops(load_design(str(FILE))).present.values():
        margins = stability_margins(loop.open_loop)
        assert margins.stable
        assert margins.gain_margin_db > 6.0
        assert margins.phase_margin_deg > 45.0


def test_it_is_found(conditional: Conditional) -> None:
    assert conditional.diverges
    assert conditional.hidden
    assert conditional.limiter == "voltage"
    assert conditional.threshold_rad < conditional.full_deflection_rad


def test_the_threshold_is_where_steps_stop_settling(conditional: Conditional) -> None:
    """By the simulator itself, outside the validator: below it settles, above it runs away."""
    design = load_design(str(FILE))
    for factor, settles in ((0.99, True), (1.01, False)):
        size = factor * conditional.threshold_rad
        run = simulate(design, commands.step(size), 20.0)
        left = np.abs(run.output_angle_rad[-2000:] - size).max() / size
        assert bool(left < 0.05) is settles
        assert bool(left > 1.0) is not settles


def test_lower_gain_margin_by_hand(conditional: Conditional) -> None:
    """Three integrations, two zeros: stable above g = 1/(w_v (Tn + 1/Kv)), w_v = Kp kM/J, by Routh.

    The delay-free cubic with an ideal current loop; the sampled loop with its current loop lies within 3 %.
    """
    by_hand = 1.0 / (2.5 * 0.02 / 1e-3 * (0.041 + 1.0 / 24.0))
    assert conditional.margins["i_ref"].gain_lower == pytest.approx(by_hand, rel=0.05)


def test_the_describing_function_predicts_the_limit_cycle(conditional: Conditional) -> None:
    """First harmonic only: amplitude and frequency of the limit cycle within a fifth."""
    (one,) = conditional.predictions
    assert one.point == "i_ref"
    assert one.limit == pytest.approx(12.0)
    assert not one.antiwindup
    assert saturation_gain(one.amplitude / one.limit) == pytest.approx(one.gain_lower, rel=1e-9)
    assert conditional.oscillation_hz == pytest.approx(one.frequency_hz, rel=0.2)
    assert conditional.oscillation_rad == pytest.approx(one.output_rad, rel=0.2)


def test_it_goes_away_with_the_limit_or_with_knowledge_of_it() -> None:
    """More voltage: the border moves away. The current limited where the velocity controller knows: none."""
    design = load_design(str(FILE))
    more = replace(design, limits=replace(design.limits, voltage_V=48.0))
    assert not look(more).diverges
    known = replace(design, limits=replace(design.limits, peak_current_A=12.0, voltage_V=200.0))
    kept = look(known)
    assert not kept.diverges
    assert all(one.antiwindup for one in kept.predictions)


def test_the_threshold_grows_with_the_limit(conditional: Conditional) -> None:
    """A scaling truth: frictionless, all amplitudes go with the limit."""
    design = load_design(str(FILE))
    smooth = replace(design, friction=replace(design.friction, dry_torque_Nm=0.0))
    half = replace(smooth, limits=replace(smooth.limits, voltage_V=6.0))
    whole = step_threshold(smooth, 1822)[0]
    assert step_threshold(half, 1822)[0] == pytest.approx(0.5 * whole, rel=3e-3)


@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate", "ctms-motor-position", "emps"])
def test_shipped_designs_settle_from_every_step(name: str) -> None:
    result = look(load_design(name))
    assert not result.diverges
    assert result.next_rad is None


def test_the_validator_says_so() -> None:
    result = validate(load_design(str(FILE)), QUICK)
    assert not result.not_met  # every small-signal prediction holds
    assert not result.passed  # and yet
    assert "makes the drive diverge" in str(result)
    assert result.verdict == "not met"
    made = section(result.conditional)
    assert made["status"] == "fail"
    words = made["result"]
    assert f"{degrees(result.conditional.threshold_rad):.4g} deg" in words
    assert "although every loop is stable by its linear margins" in words


def test_saturation_gain() -> None:
    """Analytic: 1 up to the limit, 1/3 + sqrt(3)/(2 pi) at twice the limit, 4/(pi a) far beyond."""
    assert saturation_gain(0.5) == 1.0
    assert saturation_gain(2.0) == pytest.approx(1.0 / 3.0 + 3.0**0.5 / (2.0 * pi), rel=1e-12)
    assert saturation_gain(1e4) == pytest.approx(4.0 / (pi * 1e4), rel=1e-8)
    for gain in (0.9, 0.3, 0.01):
        assert saturation_gain(saturation_ratio(gain)) == pytest.approx(gain, rel=1e-10)


def test_without_limits_there_is_nothing_to_find() -> None:
    design = load_design(str(FILE))
    free = replace(design, limits=replace(design.limits, voltage_V=1e9, peak_current_A=inf))
    assert step_threshold(free, 1822) == (None, None)
