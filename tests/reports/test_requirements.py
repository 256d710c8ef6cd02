"""Requirements: verdict and distance; those on failures, duty, limit cycles and corners, and their tables."""

import math
from dataclasses import replace
from math import degrees
from typing import Any

import pytest

from actuator_lti import InputError, assemble_loops, stability_margins
from actuator_lti.asked.quantities import ANALYSIS_QUANTITIES, QUANTITIES
from actuator_lti.batch import variable_paths
from actuator_lti.design import (
    design_hash,
    load_design,
    read_design_text,
    with_overrides,
    with_values,
    write_design,
)
from actuator_lti.design.model import Design, Requirement, Waiver
from analyses.corners import corners
from analyses.duty import Asked as DutyAsked
from analyses.duty import duty
from analyses.failures import Asked, failures
from analyses.limit_cycles import limit_cycles
from analyses.monte_carlo import MonteCarloSettings, monte_carlo
from analyses.specification.capability import drive_figures
from analyses.specification.requirements import RequirementVerdict, evaluate_requirements, tally
from analyses.stiffness import stiffness
from reports import document as doc
from reports.sections.duty import section as duty_section
from reports.sections.failures import section as failures_section
from reports.sections.requirements import item, result, table
from reports.sections.stiffness import section as stiffness_section
from reports.terminal import verdict_table

AMBER = load_design("ilr33-amber")


def judged(design: Design, waivers: tuple[Waiver, ...] = (), **keys: Any) -> RequirementVerdict:
    asked = replace(design, requirements=(Requirement(id="r", **keys),), waivers=waivers)
    (verdict,) = evaluate_requirements(asked)
    return verdict


def test_every_shipped_requirement_is_met_with_its_distance() -> None:
    for name in ("ctms-motor-position", "ilr33-amber-multirate", "emps"):
        assert tally(evaluate_requirements(load_design(name))).passes
    verdicts = evaluate_requirements(AMBER)
    assert tally(verdicts).passes
    by_id = {verdict.id: verdict for verdict in verdicts}
    assert len(by_id) == len(verdicts) == 12
    deg = stability_margins(assemble_loops(AMBER).velocity.open_loop).phase_margin_deg
    result = by_id["phase-margin/velocity"]
    assert (result.value, result.distance) == pytest.approx((deg, deg - 45.0), rel=1e-12)


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
    current, velocity = ({one.loop: one for one in found}[loop] for loop in ("current", "velocity"))
    assert (current.verdict, velocity.verdict, "unstable" in velocity.reason) == ("met", "not met", True)


def test_a_lower_gain_margin_counts_by_its_size() -> None:
    verdicts = evaluate_requirements(load_design("emps"))
    assert all(one.value > 0 for one in verdicts if one.requirement.quantity == "gain_margin")


def test_a_loop_that_the_design_lacks_is_not_proven_and_a_waiver_makes_it_grey() -> None:
    """It lets go of nothing else."""
    design = load_design("ctms-motor-position")
    lacking = {"quantity": "gain_margin", "unit": "dB", "minimum": 6.0, "loop": "current"}
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
    keys = {"quantity": "bandwidth", "unit": "Hz", "minimum": 1.0}
    said = "quantity = 'beauty': allowed are gain_margin", "loop = 'outer': allowed are"
    for wrong, words in zip(({"quantity": "beauty"}, {"loop": "outer"}), said, strict=True):
        with pytest.raises(InputError, match=words):
            judged(AMBER, **keys | wrong)


# -- the drive's own figures: those of the paper's equations are in tests/validation ----------------------


def test_a_drive_that_friction_holds_does_not_move_and_a_load_is_a_number() -> None:
    result = drive_figures(AMBER, 1e3)
    assert (result.output_rate_rad_s, result.acceleration_rad_s2, result.rate_limit) == (0.0, 0.0, "force")
    with pytest.raises(InputError, match="must be finite"):
        drive_figures(AMBER, math.nan)


TABLES = {
    "failure.stop": "15 deg", "failure.deflection": "3 deg", "failure.detection_time": "20 ms",
    "failure.load": "2 N*m", "duty.amplitude": "4 deg", "duty.frequency": "2 Hz", "duty.load": "3 N*m",
    "duty.share": "0.5", "duty.cycle": "20 s", "temperature.thermal_resistance": "2 K/W",
}  # fmt: skip


FIN = with_overrides(load_design("fin"), TABLES)


def requirement(quantity: str, **limits: float) -> Requirement:
    unit = QUANTITIES[quantity].unit
    return Requirement(id=quantity, quantity=quantity, unit=unit, **limits)


def test_the_tables_are_read_written_and_hashed_where_they_stand() -> None:
    again, bare = read_design_text(write_design(FIN), "again"), load_design("fin")
    assert (again.failure, again.duty) == (FIN.failure, FIN.duty)
    assert design_hash(again) == design_hash(FIN) != design_hash(replace(FIN, failure=None))
    assert design_hash(read_design_text(write_design(bare), "again")) == design_hash(bare)
    asked, wanted = Asked.of(FIN), DutyAsked.of(FIN)
    assert (asked.detection_s, asked.load_Nm) == (pytest.approx(0.02), 2.0)
    assert (wanted.frequency_hz, wanted.share, wanted.cycle_s) == (pytest.approx(2.0), 0.5, 20.0)
    assert Asked.of(FIN, load_Nm=1.0).load_Nm == 1.0
    assert not any(path.startswith(("failure.", "duty.")) for path in variable_paths(FIN))


def test_every_requirement_reads_its_analysis() -> None:
    """Each value is that of the analysis asked by itself; limits on either side of it pass and fail."""
    failed, used = failures(FIN), duty(FIN)
    wanted = {
        "hard_over_time": failed.case("hard-over").to_stop_s,
        "failure_deflection": degrees(max(one.at_detection_rad for one in failed.cases)),
        "failure_moment": max(one.peak_moment_Nm for one in failed.cases),
        "duty_current": used.rms_A,
        "winding_temperature": used.heating.final_degC,
        "limit_cycle": 0.0 if limit_cycles(FIN).hunting is None else None,
    }
    lower = {name: ANALYSIS_QUANTITIES[name].better > 0 for name in wanted}
    side = {name: "minimum" if lower[name] else "maximum" for name in wanted}
    limits = {f"{name} {by}": (name, wanted[name] + by) for name in wanted for by in (1e-3, -1e-3)}
    asked = [replace(requirement(of, **{side[of]: limit}), id=id) for id, (of, limit) in limits.items()]
    for one in evaluate_requirements(replace(FIN, requirements=tuple(asked))):
        name, _, shift = one.id.partition(" ")
        assert one.value == pytest.approx(wanted[name], rel=1e-9), one.id
        assert (one.verdict == "met") is (lower[name] is (float(shift) < 0.0)), one.id


@pytest.mark.parametrize(("ask", "section", "quantity", "limit"), [
    (failures, failures_section, "failure_moment", {"maximum": 1e-3}),
    (failures, failures_section, "hard_over_time", {"minimum": 1e-6}),
    (duty, duty_section, "duty_current", {"maximum": 1e-3}),
    (duty, duty_section, "winding_temperature", {"maximum": 1e4}),
    (stiffness, stiffness_section, "least_stiffness", {"minimum": 1e6}),
    (stiffness, stiffness_section, "static_stiffness", {"minimum": 1e-6}),
    (stiffness, stiffness_section, "lost_motion", {"maximum": 1e-3}),
])  # fmt: skip
def test_an_analysis_judges_the_requirements_on_what_it_finds_as_margins_does(ask, section, quantity, limit):
    other = Requirement(id="other", quantity="phase_margin", unit="deg", loop="every", minimum=179.0)
    design = replace(FIN, requirements=(requirement(quantity, **limit), other))
    result = ask(design)
    assert result.requirements == evaluate_requirements(design)[:1]
    missed = {*limit.values()} <= {1e-3, 1e6}
    assert result.verdict == result.requirements[0].verdict == ("not met" if missed else "met")
    words, status = (section(result)[key] for key in ("result", "status"))
    assert status == ("fail" if missed else "pass" if ask is stiffness else "info")
    assert (f"Not met: Drive: {QUANTITIES[quantity].words}" in words) is missed
    assert ask(FIN).requirements == ()


def test_a_rate_beyond_the_profile_of_the_command_says_so() -> None:
    slow = replace(AMBER, command=replace(AMBER.command, rate_rad_s=0.1))
    keys = {"quantity": "output_rate", "unit": "deg/s", "minimum": 1.0}
    told = "command.rate lets no command ask for more than 5.73 deg/s"
    assert [judged(design, **keys).reason for design in (AMBER, slow)] == ["", told]


def test_margins_at_the_corners() -> None:
    """The fin is not stable at its worst tolerances; the ball screw's least margins are the table's."""
    asked = tuple(requirement(f"corner_{name}_margin", minimum=3.0) for name in ("gain", "phase"))
    verdicts = evaluate_requirements(replace(load_design("fin"), requirements=asked))
    assert [one.verdict for one in verdicts] == ["not met"] * 2
    design = replace(load_design("ballscrew"), requirements=asked)
    gain, phase = evaluate_requirements(design)
    loops = [one.margins for corner in corners(design).corners for one in corner.figures.values()]
    assert gain.value == pytest.approx(min(abs(one.gain_margin_db) for one in loops))
    assert phase.value == pytest.approx(min(abs(one.phase_margin_deg) for one in loops))


@pytest.mark.parametrize(("name", "quantity", "reason"), [
    ("fin", "winding_temperature", "the design does not state what this needs"),
    ("emps", "duty_current", "duty: an ideal torque source has no current"),
])  # fmt: skip
def test_a_figure_that_there_is_not_says_why(name: str, quantity: str, reason: str) -> None:
    asked = replace(load_design(name), requirements=(requirement(quantity, maximum=1.0),))
    (found,) = evaluate_requirements(asked)
    assert (found.verdict, found.reason) == ("not proven", reason)
    for block in (*table([found]), verdict_table(doc.verdicts([item(found)]))):
        assert f"not proven ({reason})" in str(block["rows"])


def test_a_load_on_a_linear_axis_is_told_in_newtons() -> None:
    asked = replace(requirement("output_rate", minimum=9.0), load_Nm=800.0)
    verdicts = evaluate_requirements(replace(load_design("ballscrew"), requirements=(asked,)))
    assert result(verdicts).endswith("Not met: Drive: output rate at 800 N.")


def test_a_study_of_many_designs_leaves_them_out_and_says_so(tmp_path) -> None:
    """Holding a load takes more than a uA: what fails as designed is not met; the rest is not proven."""
    limits = {"little": 1e-6, "enough": 1e6}
    asked = [replace(requirement("duty_current", maximum=most), id=id) for id, most in limits.items()]
    design = replace(FIN, requirements=(*load_design("fin").requirements, *asked))
    result = monte_carlo(design, tmp_path, MonteCarloSettings(samples=16, worst_cases=False))
    assert not {*limits} & {odds.id for odds in result.odds}
    assert {one.id: one.verdict for one in result.left_out} == {"little": "not met", "enough": "not proven"}
    assert ["nominal design: " in one.reason for one in result.left_out] == [True, False]
    assert ("not sampled" in result.left_out[1].reason, result.verdict) == (True, "not met")
