"""A drive that came out otherwise has a controller that still computes with the nominal J, kM, R and kE."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti.batch import Population, linear_figures
from actuator_lti.design import load_design
from actuator_lti.design.access import varied
from actuator_lti.design.loader import read_design_text
from actuator_lti.design.model import Design, PositionLoop, VelocityLoop
from actuator_lti.design.writing import design_hash, write_design
from actuator_lti.drive.steady import back_emf_Nms_rad, drive_gain
from analyses.corners.run import at_temperature
from nonlinear import commands, simulate
from tests.loops.loop_designs import controlled, source_drive

ALPHA = 100.0  # rad/s2 at the motor


def fed() -> Design:
    """A P-P cascade on a torque source of 0.5 N m/V, all of its acceleration fed forward."""
    position = PositionLoop(gain=50.0, feedforward=1.0, acceleration_feedforward=1.0)
    loops = {"velocity": VelocityLoop(gain=0.2), "position": position, "computing_delay_s": 1e-4}
    return source_drive(1e-3, 0.5, 1e-3, 1e6, controller=loops)


def lag(design: Design) -> float:
    """Angle at the motor by which it is behind a parabola, settled."""
    t = np.arange(0.0, 1.0, design.controller.period_s)
    command = commands.sampled(t, 0.5 * ALPHA * t**2 / design.total_ratio)
    run = simulate(design, command, duration_s=float(t[-1]))
    return float((run.reference_rad[-1] - run.output_angle_rad[-1]) * design.total_ratio)


@pytest.mark.parametrize("share", [-0.2, 0.2])
def test_an_inertia_that_came_out_otherwise_lags_by_what_is_not_fed_forward(share: float) -> None:
    """Kp Kv e makes up for it: e = share J a/(kM Kp Kv) more than where the controller knows the inertia."""
    design = fed()
    other = varied(design, {"motor.rotor_inertia": (1.0 + share) * design.motor.rotor_inertia_kgm2})
    loops = design.controller
    per_angle = loops.velocity.gain * loops.position.gain * design.motor.source_gain_Nm_V
    expected = share * design.inertia_kgm2 * ALPHA / per_angle
    assert lag(other) - lag(design) == pytest.approx(expected, rel=1e-9)
    as_file = read_design_text(write_design(other))
    assert as_file.controller.position.acceleration_feedforward == pytest.approx(1.0 / (1.0 + share))
    assert lag(as_file) == pytest.approx(lag(other), rel=1e-9)
    assert design_hash(as_file) == design_hash(other) != design_hash(replace(other, nominal=None))


def test_many_drives_are_each_of_them_alone() -> None:
    """What of the response to the command hangs on J, R and kE fed forward."""
    design, count = load_design("joint"), 3
    design = controlled(design, position={"acceleration_feedforward": 1.0},
                        current={"back_emf_feedforward": 1.0, "resistance_feedforward": 1.0})  # fmt: skip
    values = {"motor.rotor_inertia": design.motor.rotor_inertia_kgm2 * np.array([0.7, 1.0, 1.4]),
              "motor.resistance": design.motor.resistance_ohm * np.array([1.3, 1.0, 0.8])}  # fmt: skip
    many = linear_figures(Population(design, values, count))
    for k in range(count):
        alone = varied(design, {path: array[k] for path, array in values.items()})
        one = linear_figures(Population(replace(alone, name="alone"), {}, 1))
        for loop in many.loops:
            found = many.quantity("bandwidth", loop)[k]
            assert found == pytest.approx(one.quantity("bandwidth", loop)[0], rel=1e-9, nan_ok=True), loop


def test_a_hot_winding_is_not_made_up_for() -> None:
    """P current loop: i = (Kp + R_25) i_ref/(Kp + R), torque kM i; back-EMF fed as at 25 degC."""
    whole = {"resistance_feedforward": 1.0, "back_emf_feedforward": 1.0}
    design = controlled(load_design("ilr33-amber"), current={"integral_time_s": None, **whole})
    cold, hot = (at_temperature(design, degC) for degC in (25.0, 120.0))
    motor, now, gain = cold.effective_motor, hot.effective_motor, design.controller.current.gain_V_A
    R, left = now.resistance_ohm, now.back_emf_constant_Vs_rad - motor.back_emf_constant_Vs_rad
    assert abs(left) > 0.0 < R - motor.resistance_ohm
    expected = now.torque_constant_Nm_A * (gain + motor.resistance_ohm) / (gain + R)
    assert drive_gain(hot) == pytest.approx(expected, rel=1e-12)
    assert back_emf_Nms_rad(hot) == pytest.approx(now.torque_constant_Nm_A * left / (gain + R), rel=1e-12)
    assert drive_gain(cold) == pytest.approx(cold.effective_motor.torque_constant_Nm_A, rel=1e-12)


def test_a_drive_whose_file_states_its_temperature_has_a_controller_set_for_it() -> None:
    """All of the resistance fed forward: torque kM i_ref, of the design as it is written."""
    design = controlled(
        load_design("ilr33-amber"), current={"integral_time_s": None, "resistance_feedforward": 1.0}
    )
    warm = design.with_values({"temperature.winding": "90 degC"})
    assert warm.effective_motor.resistance_ohm > design.effective_motor.resistance_ohm
    assert drive_gain(warm) == pytest.approx(warm.effective_motor.torque_constant_Nm_A, rel=1e-12)
