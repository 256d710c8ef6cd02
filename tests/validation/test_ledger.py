"""The ledger: nothing dropped, failures counted, reasons given; the command and its exit status."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from actuator_lti import InputError, load_design
from actuator_lti.errors import TooManyTicks
from analyses.validation import QUICK, Settings, Validation, validate
from analyses.validation.ledger import Entry, entry, not_judged
from analyses.validation.reading import Reading
from analyses.validation.validate import _Work
from nonlinear.operating_motion import operating_motion, operating_motion_at
from reports.cli.main import main
from reports.sections.validation import section

CONDITIONAL = Path(__file__).with_name("conditional.toml")
OWN = Settings(large_signals=False, friction_effects=False, specification=False)
EACH = {
    "bandwidth",
    "bandwidth_90deg",
    "resonance_peak",
    "phase_margin",
    "gain_margin_up",
    "gain_margin_down",
    "delay_margin",
    "sensitivity_peak",
    "complementary_peak",
    "rise_time",
    "overshoot",
    "settling_time",
}


@pytest.fixture(scope="module", params=["ilr33-amber", "ilr33-amber-multirate"])
def validation(request: pytest.FixtureRequest) -> Validation:
    return validate(load_design(request.param), OWN)


def rows(validation: Validation, loop: str, quantity: str) -> list[Entry]:
    return [row for row in validation.ledger if row.loop == loop and row.quantity == quantity]


def test_every_prediction_of_every_loop_is_there_and_holds(validation: Validation) -> None:
    for loop in ("current", "velocity", "position"):
        judged = {row.quantity for row in validation.ledger if row.loop == loop and row.passed is not None}
        assert judged >= EACH, loop
    assert validation.failed == ()
    assert validation.passed


def test_figures_are_met_far_within_their_tolerances(validation: Validation) -> None:
    """The simulator is the sampled loop while nothing acts: frequencies 1e-5, dB 1e-3, samples the same."""
    for row in validation.ledger:
        if row.passed is None or row.difference is None:
            continue
        if row.unit == "Hz":
            assert abs(row.difference) < 1e-5 * row.predicted, row
        elif row.unit in ("dB", "deg") and "margin_" not in row.quantity:
            assert abs(row.difference) < 1e-3, row
        elif row.unit == "s" and "margin" not in row.quantity:
            assert abs(row.difference) < 1e-9, row


def test_what_cannot_hold_is_shown_with_the_reason(validation: Validation) -> None:
    shown = [row for row in validation.ledger if row.passed is None]
    assert shown
    assert all(row.reason for row in shown)
    steps = [row for row in shown if row.quantity == "rise_time"]
    assert len(steps) == len(load_design("ilr33-amber").validation.amplitude_fractions)
    assert all("speed limit" in row.reason and "dry friction" in row.reason for row in steps)
    assert all(row.measured > row.predicted for row in steps)


def test_from_rest_dry_friction_costs_bandwidth(validation: Validation) -> None:
    (at_rest,) = (row for row in rows(validation, "position", "bandwidth") if row.passed is None)
    assert "dry friction" in at_rest.reason
    assert at_rest.measured < 0.99 * at_rest.predicted


def test_break_points_are_swept_with_all_loops_closed(validation: Validation) -> None:
    assert set(validation.points) == {"u", "i_ref"}
    for point in validation.points.values():
        assert point.sweep.valid.all()
        assert point.open_errors.worst_gain_db < 1e-4


def test_without_friction_and_limits_steps_from_rest_are_judged() -> None:
    """A drive without dry friction, a step that no limit touches: the prediction has to hold there too."""
    design = load_design("ctms-motor-position")
    small = replace(design.validation, amplitude_fractions=(0.05, 1.0))
    result = validate(replace(design, validation=small), OWN)
    rest = [row for row in result.ledger if row.condition.startswith("from rest, step")]
    assert [row.passed for row in rest] == [True] * 6
    assert result.passed


def test_a_failure_is_a_failure() -> None:
    assert entry("position", "bandwidth", "Hz", 10.0, Reading(10.02, 0.01 / 3.0)).passed is False
    assert entry("position", "bandwidth", "Hz", 10.0, Reading(10.005, 0.01 / 3.0)).passed is True
    assert entry("position", "bandwidth", "Hz", 10.0, Reading(None, 0.01 / 3.0)).passed is False
    assert entry("position", "gain_margin", "dB", None, Reading(3.0, 0.01 / 3.0)).passed is False
    assert entry("position", "gain_margin", "dB", float("inf"), Reading(None, 0.01 / 3.0)).passed is True
    assert not_judged("position", "overshoot", "%", 1.0, 2.0, "a limit").passed is None


def test_a_failed_entry_fails_the_validation(validation: Validation) -> None:
    bad = entry("position", "bandwidth", "Hz", 10.0, Reading(10.02, 0.01 / 3.0))
    worse = replace(validation, ledger=(*validation.ledger, bad))
    assert worse.failed == (bad,)
    assert not worse.passed


def test_an_unstable_loop_is_reported_not_raised() -> None:
    design = load_design("ilr33-amber")
    loud = replace(design.controller, velocity=replace(design.controller.velocity, gain=3.0))
    result = validate(replace(design, controller=loud), OWN)
    assert not result.passed
    bad = [row for row in result.ledger if row.quantity == "stability"]
    assert {row.loop for row in bad} >= {"velocity"}
    assert all("unstable" in row.reason and row.passed for row in bad)
    assert "the velocity loop is unstable" in str(result)


def test_ride_leaves_room_everywhere() -> None:
    design = load_design("ilr33-amber")
    limits, result = design.limits, operating_motion(design)
    assert 0.2 * limits.speed_rad_s < result.speed_rad_s <= 0.4 * limits.speed_rad_s
    assert result.voltage_V <= 0.4 * limits.voltage_V
    assert result.current_A <= 0.4 * limits.peak_current_A
    at_speed = operating_motion_at(design, 100.0)
    friction = design.friction
    assert at_speed.current_A * 5.9e-3 == pytest.approx(
        friction.dry_Nm(0.0) + 100.0 * friction.viscous(), rel=1e-12
    )


def test_a_drive_that_cannot_ride_is_refused() -> None:
    design = load_design("ilr33-amber")
    stuck = replace(design, friction=replace(design.friction, dry_torque_Nm=0.1))
    with pytest.raises(InputError, match="no steady motion"):
        validate(stuck, QUICK)


def test_sections_put_the_verdicts_first(validation: Validation) -> None:
    made = section(validation)
    assert made[0]["id"] == "validation"
    assert made[0]["blocks"][0]["kind"] == "verdicts"
    assert all(item["passed"] for item in made[0]["blocks"][0]["items"])
    figures = [block["figure"] for part in made for block in part["blocks"] if block["kind"] == "figure"]
    assert figures.count("overlay_sweep") == 3
    assert {"rest_sweep", "confirmation"} <= set(figures)
    json.dumps(made, allow_nan=False)


def test_command_passes_and_prints_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "ctms-motor-position", "--quick", "--json"]) == 0
    made = json.loads(capsys.readouterr().out)
    assert made["kind"] == "validation"
    assert made["verdict"]["passed"] is True


def test_command_fails_on_the_conditional_design(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["validate", str(CONDITIONAL), "--quick", "--quiet"]) == 1
    out = capsys.readouterr().out
    assert "do not settle" in out
    assert "FAIL" in out
    assert not list(tmp_path.iterdir())


def test_command_refuses_an_unknown_design(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "no-such-drive"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_runs_that_would_take_too_long_are_not_judged_and_say_so() -> None:
    """Seed 43112 asked for 3e11 ticks from rest, and that ended as an unforeseen failure."""
    design = load_design("ilr33-amber")
    work = _Work(design, QUICK, None, design)

    def endless() -> str:
        raise TooManyTicks("3e+11 ticks to simulate")

    assert work._within(0.5, "motion from rest", endless, "nothing") == "nothing"
    assert "motion from rest: not judged: 3e+11 ticks to simulate" in work.notes


@pytest.mark.parametrize(
    ("unit", "predicted", "error", "judged"),
    [
        ("dB", 6.0, 0.9, True),
        ("dB", 6.0, 1.1, False),
        ("%", 0.0, 6.0, True),
        ("%", 0.0, 7.0, False),
        ("Hz", 100.0, 6.0, True),
        ("Hz", 100.0, 7.0, False),
        ("Hz", None, 7.0, True),
    ],
)
def test_a_measurement_that_may_be_off_by_as_much_judges_nothing(
    unit: str, predicted: float | None, error: float, judged: bool
) -> None:
    """A row that allowed 263 % agreed: 20 %, 3 dB, a fifth are the most; the tolerance is three errors."""
    row = entry("velocity", "bandwidth", unit, predicted, Reading(predicted, error))
    assert (row.passed is not None) is judged
    if not judged:
        assert "too large to judge" in row.reason
