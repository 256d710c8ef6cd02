"""Actuator figures: closed form against the simulator, step times, duty, and the sections of the page."""

import math

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import with_overrides, with_values
from actuator_lti.drive.steady import motor_torque_Nm
from analyses.friction_effects import friction_effects
from analyses.large_signal import large_signals
from analyses.specification import Specification, specification
from analyses.specification.capability import drive_figures, thermal_duty, torque_speed_plane
from nonlinear import commands, simulate
from nonlinear.bench.operating_motion import on_the_bench
from reports import document as doc
from reports.drawing import draw_svg
from reports.sections import friction_effects as friction_section
from reports.sections import large_signal as large_section
from reports.sections import specification as specification_section
from tests.changed import changed

AMBER = load_design("ilr33-amber")
SHIPPED = ("ilr33-amber", "ilr33-amber-multirate", "emps", "ctms-motor-position")
UNDER_LOAD = {
    "fin": {"load.moment_damping": "2 N*m*s/rad"},
    "ilr33-amber": {"load.moment_damping": "300 N*m*s/rad"},
    "ilr33-amber-compliant": {"load.friction.dry_torque": "2 N*m", "load.friction.viscous": "3 N*m*s/rad"},
}


@pytest.fixture(scope="module")
def amber() -> Specification:
    return specification(AMBER)


@pytest.mark.parametrize("name", SHIPPED)
def test_the_simulated_rate_is_that_of_the_closed_form(name: str) -> None:
    for one in specification(load_design(name)).capabilities:
        assert one.simulated_rate_rad_s == pytest.approx(one.figures.output_rate_rad_s, rel=1e-6)
        assert 0.7 < one.simulated_acceleration_rad_s2 / one.figures.acceleration_rad_s2 <= 1.0 + 1e-9
        if one.figures.motor_current_A is not None:
            assert one.simulated_current_A == pytest.approx(one.figures.motor_current_A, rel=1e-6)


def test_a_drive_that_takes_an_hour_to_run_up_is_run_for_its_start(monkeypatch) -> None:
    """No run is beyond the 60 000 samples of a step; the acceleration is that of the closed form."""
    ran = []

    def counted(design, command, time, load, **more):
        ran.append(time / design.controller.period_s)
        return simulate(design, command, time, load, **more)

    monkeypatch.setattr("analyses.specification.capability.simulate", counted)
    slow = changed(AMBER, load={"inertia_kgm2": 1e9 * AMBER.load.inertia_kgm2})
    push = drive_figures(slow, 0.0).acceleration_rad_s2
    found = specification(slow).capabilities[0].simulated_acceleration_rad_s2
    assert max(ran) <= 60_000
    assert 0.9 < found / push <= 1.0 + 1e-9


def test_current_and_rate_at_8_Nm(amber: Specification) -> None:
    """(C0 + CM 8 + Cv 942.5)/kM = 3.037 A, three quarters of the continuous current; paper: 22.7 deg/s."""
    loaded = amber.capabilities[1]
    current = (2.25e-3 + 8 * 1.34e-3 + 942.5 * 5.25e-6) / 5.9e-3
    assert (loaded.figures.load_Nm, loaded.figures.rate_limit) == (8.0, "speed limit")
    assert loaded.figures.motor_current_A == pytest.approx(current, rel=1e-12)
    assert loaded.simulated_current_A == pytest.approx(current)
    assert loaded.current_ratio == pytest.approx(loaded.simulated_current_A / 4.0)
    assert math.degrees(loaded.figures.output_rate_rad_s) == pytest.approx(22.7, abs=0.05)
    assert loaded.duty == 1.0


def test_thermal_duty() -> None:
    assert thermal_duty(AMBER, 12.0) == pytest.approx(1.0 / 9.0)
    assert thermal_duty(AMBER, 2.0) == 1.0
    assert thermal_duty(load_design("emps"), None) is None


def test_a_sine_within_the_limits_needs_the_current_of_its_friction(amber: Specification) -> None:
    """Slow sine: dry friction is a square wave, viscous a sine in phase: rms of their sum by hand."""
    move = next(m for m in amber.manoeuvres if m.load_Nm == 8.0 and "70 %" in m.name)
    dry, viscous = (2.25e-3 + 8 * 1.34e-3) / 5.9e-3, 5.25e-6 * 0.7 * 942.5 / 5.9e-3
    by_hand = math.sqrt(dry**2 + viscous**2 / 2.0 + 4.0 / math.pi * dry * viscous)
    assert move.rms_current_A == pytest.approx(by_hand, rel=0.01)


def test_step_times(amber: Specification) -> None:
    """A small step takes the linear time; a large one the rate limit: 0.8 A/R from 10 to 90 %."""
    for load in (0.0, 8.0):
        small, *_, large = steps = [one for one in amber.steps if one.load_Nm == load]
        rises = [one.rise_time_s or 0.0 for one in steps]
        assert rises == sorted(rises)
        assert large.fraction == 1.0
        assert large.rise_time_s == pytest.approx(0.8 * large.amplitude_rad / (942.5 / 2376.0), rel=2e-3)
        assert ("speed" in small.limits, "speed" in large.limits) == (False, True)
        assert all(one.settling_time_s is not None for one in steps)


def test_the_plane_is_bounded_by_the_limits(amber: Specification) -> None:
    bounds = {curve.name: curve for curve in amber.plane.bounds}
    assert set(bounds) == {"voltage limit", "peak current", "continuous current", "speed limit"}
    assert bounds["peak current"].torque_Nm[0] == pytest.approx(12.0 * 5.9e-3)
    assert bounds["voltage limit"].speed_rad_s[-1] == pytest.approx(12.0 / 5.9e-3)
    for move in amber.manoeuvres:
        assert move.peak_torque_Nm <= 12.0 * 5.9e-3 * (1.0 + 1e-6)


def test_a_drive_that_cannot_move_says_so() -> None:
    weak = with_values(AMBER, {"limits.peak_current": 2.0, "limits.continuous_current": 2.0})
    result = specification(weak).capabilities
    assert result[1].figures.output_rate_rad_s == 0.0
    assert result[1].simulated_rate_rad_s is None
    assert result[0].simulated_rate_rad_s == pytest.approx(result[0].figures.output_rate_rad_s, rel=1e-6)


@pytest.mark.parametrize("name", SHIPPED)
def test_sections_are_plain_and_their_figures_can_be_drawn(name: str) -> None:
    design = load_design(name)
    sections = [
        large_section.section(large_signals(design, counts=(10, 8))),
        friction_section.section(friction_effects(design)),
        specification_section.section(specification(design)),
    ]
    made = doc.document(title="t", subtitle="", design={}, provenance={}, sections=sections)
    again = doc.loads(doc.dumps(made))
    assert again["verdict"]["verdict"] != "not met"
    names = [block["figure"] for block in doc.figures(again)]
    assert {"map", "amplitude_bode", "torque_speed"} <= set(names)
    assert ("sawtooth" in names) == name.startswith("ilr33")
    for block in doc.figures(again):
        svg = draw_svg(block, page=False)
        assert svg.startswith("<svg")
        assert "nan" not in svg.lower().replace("nano", "")
    (table,) = [block for block in sections[-1]["blocks"] if "Rate," in block.get("caption", "")]
    assert ("Duty" in table["note"]) == any(column["key"] == "duty" for column in table["columns"])
    assert "current controller" not in table["note"]


def test_a_hunting_drive_fails_its_verdict() -> None:
    values = {"friction.breakaway_ratio": 1.5, "control.velocity.integral_time": 3e-3}
    values["control.position.gain"] = 250.0
    made = friction_section.section(friction_effects(with_values(AMBER, values)))
    assert made["status"] == "fail"
    items = next(block["items"] for block in made["blocks"] if block["kind"] == "verdicts")
    assert any(item["verdict"] == Verdict.NOT_MET and "refuted" in item["reason"] for item in items)


@pytest.mark.parametrize("name", UNDER_LOAD)
def test_the_demand_of_the_plane_is_what_steady_motion_takes(name: str) -> None:
    """Friction behind the coupling and damping of the load too: the torque of a ramp, simulated."""
    free = {"load.path": "back-drivable", "load.moment_slope": "0 N*m/rad"}
    design = with_overrides(load_design(name), {**UNDER_LOAD[name], **free})
    top = 0.3 * drive_figures(design, 0.0).output_rate_rad_s * design.total_ratio
    (curve,) = torque_speed_plane(changed(design, validation={"loads_Nm": (0.0,)}), top).demands
    wanted = float(np.interp(top, curve.speed_rad_s, curve.torque_Nm))
    run = simulate(on_the_bench(design), commands.ramp(top / design.total_ratio), 1.5)
    torque = motor_torque_Nm(design, run.current_A, run.voltage_V)[-len(run.time_s) // 10 :]
    assert run.motor_speed_rad_s[-1] == pytest.approx(top, rel=1e-3)
    assert float(torque.mean()) == pytest.approx(wanted, rel=2e-3)
