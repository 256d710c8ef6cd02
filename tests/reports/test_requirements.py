"""Verdict and distance of requirements."""

import math
from dataclasses import replace
from typing import Any

import pytest

from actuator_lti import InputError, assemble_loops, stability_margins
from actuator_lti.design import load_design, with_values
from actuator_lti.design.model import Design, Requirement, Waiver
from analyses.specification.capability import drive_figures
from analyses.specification.requirements import RequirementVerdict, evaluate_requirements, tally

AMBER = load_design("ilr33-amber")


def judged(design: Design, waivers: tuple[Waiver, ...] = (), **keys: Any) -> RequirementVerdict:
    asked = replace(design, requirements=(Requirement(id="r", **keys),), waivers=waivers)
    (verdict,) = evaluate_requirements(asked)
    return verdict


def test_every_shipped_requirement_is_met_with_its_distance() -> None:
    verdicts = evaluate_requirements(AMBER)
    assert tally(verdicts).passes
    by_id = {verdict.id: verdict for verdict in verdicts}
    assert len(by_id) == len(verdicts) == 12
    margins = stability_margins(assemble_loops(AMBER).velocity.open_loop)
    result = by_id["phase-margin/velocity"]
    assert result.value == pytest.approx(margins.phase_margin_deg, rel=1e-12)
    assert result.distance == pytest.approx(margins.phase_margin_deg - 45.0, rel=1e-12)


def test_a_missed_limit_fails_with_a_negative_distance_and_exactly_at_the_limit_is_met() -> None:
    bandwidth = {"quantity": "bandwidth", "unit": "Hz", "minimum": 30.0, "loop": "position"}
    overshoot = {"quantity": "overshoot", "unit": "%", "maximum": 5.0, "loop": "velocity"}
    for keys, sign, limit in ((bandwidth, 1.0, 30.0), (overshoot, -1.0, 5.0)):
        verdict = judged(AMBER, **keys)
        assert verdict.verdict == tally((verdict,)).verdict == "not met"
        assert verdict.distance == pytest.approx(sign * (verdict.value - limit))
        assert verdict.distance < 0.0
    value = stability_margins(assemble_loops(AMBER).position.open_loop).phase_margin_deg
    asked = {"quantity": "phase_margin", "unit": "deg", "minimum": value, "loop": "position"}
    assert judged(AMBER, **asked).verdict == "met"


def test_an_unstable_loop_meets_nothing() -> None:
    broken = with_values(AMBER, {"control.velocity.gain": 5.0})
    asked = Requirement(id="r", quantity="overshoot", unit="%", maximum=1e9, loop="every")
    found = evaluate_requirements(replace(broken, requirements=(asked,)))
    verdicts = {verdict.loop: verdict for verdict in found}
    assert verdicts["current"].verdict == "met"
    assert verdicts["velocity"].verdict == "not met"
    assert "unstable" in verdicts["velocity"].reason


def test_a_lower_gain_margin_counts_by_its_size() -> None:
    verdicts = evaluate_requirements(load_design("emps"))
    assert all(one.value > 0 for one in verdicts if one.requirement.quantity == "gain_margin")


def test_a_loop_that_the_design_lacks_is_not_proven_and_a_waiver_makes_it_grey() -> None:
    """It lets go of nothing else."""
    design, lacking = load_design("ctms-motor-position"), {"quantity": "gain_margin", "unit": "dB"}
    lacking |= {"minimum": 6.0, "loop": "current"}
    verdict = judged(design, **lacking)
    assert (verdict.verdict, verdict.reason) == ("not proven", "the design has no current loop")
    assert not tally((verdict,)).passes
    waiver = Waiver(requirement="r", reason="the voltage drive has none", date="2026-11-22")
    verdict = judged(design, (waiver,), **lacking)
    assert (verdict.verdict, verdict.role, verdict.passes) == ("not proven", "info", True)
    assert verdict.waiver.words == "waived 2026-11-22: the voltage drive has none"
    assert tally((verdict,)).words("requirements") == "0 of 1 requirements met, 1 waived"
    missed = judged(AMBER, (waiver,), quantity="bandwidth", unit="Hz", minimum=30.0, loop="position")
    assert (missed.verdict, missed.waiver, missed.passes) == ("not met", None, False)


def test_what_is_not_known_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="quantity = 'beauty': allowed are gain_margin"):
        judged(AMBER, quantity="beauty", unit="1", minimum=1.0)
    with pytest.raises(InputError, match="loop = 'outer': allowed are"):
        judged(AMBER, quantity="bandwidth", unit="Hz", minimum=1.0, loop="outer")


# -- the drive's own figures: those of the paper's equations are in tests/validation ----------------------


def test_a_drive_that_friction_holds_does_not_move_and_a_load_is_a_number() -> None:
    result = drive_figures(AMBER, 1e3)
    assert (result.output_rate_rad_s, result.acceleration_rad_s2, result.rate_limit) == (0.0, 0.0, "force")
    with pytest.raises(InputError, match="must be finite"):
        drive_figures(AMBER, math.nan)
