"""Every kind of drive is judged, whatever its outermost stage; a verdict on nothing is no pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_settings import SMALL

from actuator_lti import load_design
from actuator_lti.design.model import Coupling, Design, Gravity, Load
from analyses.validation import validate
from analyses.validation.reading import crossing, maximum
from analyses.validation.tolerance import allowed
from nonlinear.loop_setup import loop_setup, standing_setup
from nonlinear.on_the_bench import on_the_bench
from nonlinear.operating_motion import on_its_stand, operating_motion_at
from reports.sections.validation import section

AMBER = load_design("ilr33-amber")


def without(*stages: str) -> Design:
    """The drive with some of its stages left out."""
    return replace(AMBER, controller=replace(AMBER.controller, **dict.fromkeys(stages)))


@pytest.mark.parametrize(
    ("left_out", "least"),
    [(("position",), 25), (("position", "velocity"), 14), (("position", "velocity", "current"), 1)],
)
def test_a_drive_of_any_outermost_stage_is_judged(left_out: tuple[str, ...], least: int) -> None:
    validation = validate(without(*left_out), SMALL)
    judged = [row.quantity for row in validation.ledger if row.passed is not None]
    assert validation.failed == ()
    assert validation.passed
    assert len(judged) >= least
    assert "response_command" in judged


def test_a_wrong_speed_drive_is_caught() -> None:
    """The inductance a tenth of a percent off: seen by the responses of both loops."""
    wrong = without("position")
    motor = wrong.motor
    wrong = replace(wrong, motor=replace(motor, inductance_H=1.001 * (motor.inductance_H or 0.0)))
    validation = validate(without("position"), SMALL, model=wrong)
    assert {(row.loop, row.quantity) for row in validation.failed} >= {
        ("current", "response_open"),
        ("velocity", "response_open"),
        ("velocity", "response_command"),
    }


def test_nothing_judged_is_no_pass() -> None:
    validation = validate(without("position", "velocity", "current"), SMALL)
    nothing = replace(validation, ledger=())
    assert not nothing.judged
    assert not nothing.passed
    assert "nothing judged" in str(nothing)
    made = section(nothing)[0]
    assert made["status"] == "fail"
    assert made["blocks"][0]["items"][0]["passed"] is False


@pytest.mark.parametrize("loop", ["current", "velocity", "position"])
def test_a_ride_begins_in_its_steady_state(loop: str) -> None:
    """An AC motor, feed-forward in its current loop, a coupling with play: no event."""
    control = AMBER.controller
    assert control.current is not None
    current = replace(control.current, back_emf_feedforward=0.7, resistance_feedforward=0.4)
    design = replace(
        AMBER,
        motor=replace(AMBER.motor, constants="rms-line"),
        controller=replace(control, current=current),
        load=replace(AMBER.load, path="back-drivable"),
        coupling=Coupling(stiffness_Nm_rad=4e3, damping_Nms_rad=1.0, play_rad=2e-4),
    )
    setup = loop_setup(on_the_bench(design), loop)
    row = setup.row()
    row["ticks"] = 2000
    run = row.trajectory()
    assert setup.bias.speed_rad_s > 0.0
    assert setup.bias.coupling_Nm > 0.0
    assert run.events == 0
    assert np.ptp(run.motor_speed_rad_s) < 1e-9 * setup.bias.speed_rad_s
    assert np.ptp(run.current_A) < 1e-9 * setup.bias.current_A


def test_gravity_is_held_while_the_drive_stands() -> None:
    gravity = Gravity(mass_kg=1.0, arm_m=0.1, offset_rad=0.5)
    load = Load(inertia_kgm2=1e-3, path="back-drivable", gravity=gravity)
    design = on_its_stand(on_the_bench(replace(AMBER, load=load)))
    row = standing_setup(design, "position").row()
    row["ticks"] = 2000
    run = row.trajectory()
    assert np.abs(run.output_angle_rad).max() < 1e-15
    assert run.load_Nm is not None
    assert np.abs(run.load_Nm).max() < 1e-12


def test_the_current_of_a_ride_is_that_of_the_friction() -> None:
    """Equations (2) and (9) by hand, with an AC motor: kM is its torque per rms ampere over sqrt(3/2)."""
    ac = replace(AMBER, motor=replace(AMBER.motor, constants="rms-line"))
    result, friction = operating_motion_at(ac, 50.0), AMBER.friction
    kM = (AMBER.motor.torque_constant_Nm_A or 0.0) / np.sqrt(1.5)
    torque = friction.dry_torque_Nm + 50.0 * friction.viscous_Nms_rad + friction.offset_torque_Nm
    assert result.current_A == pytest.approx(torque / kM, rel=1e-12)


@pytest.mark.parametrize("points", [6, 10, 20])
def test_a_reading_knows_its_own_error(points: int) -> None:
    """A lag of first order falls to 1/sqrt(2) at its corner: closed form."""
    f = np.geomspace(0.2, 7.0, points)
    lag = 1.0 / np.sqrt(1.0 + (f / 1.3) ** 2)
    k = int(np.flatnonzero(lag < np.sqrt(0.5))[0]) - 1
    corner = crossing(f, lag, k, float(np.sqrt(0.5)))
    assert corner.value is not None
    assert abs(corner.value - 1.3) <= allowed(corner.error, 1.3)


@pytest.mark.parametrize("points", [20, 40, 80])
def test_a_peak_knows_its_own_error(points: int) -> None:
    """A resonance of second order, of known height and place."""
    f, damping = np.geomspace(0.2, 7.0, points), 0.3
    resonant = 1.0 / np.abs(1.0 - (f / 1.3) ** 2 + 2j * damping * f / 1.3)
    top, at = maximum(f, resonant)
    assert top.value is not None
    assert at.value is not None
    peak = 1.0 / (2.0 * damping * np.sqrt(1.0 - damping**2))
    assert abs(top.value - peak) <= allowed(top.error, peak)
    assert abs(at.value - 1.3 * np.sqrt(1.0 - 2.0 * damping**2)) <= allowed(at.error, 1.3)
