"""Model.md section 4 behind a coupling: between its events the running drive is the sampled linear one."""

from __future__ import annotations

from dataclasses import dataclass, replace

import control
import numpy as np
import pytest

from actuator_lti import assemble_loops
from actuator_lti.design.model import Design, Friction, LoadFriction
from nonlinear import State, Trajectory, commands, simulate
from tests.nonlinear.elastic_drive import drive_f

TICKS, SPEED, DRY, LOAD_DRY = 20_000, 100.0, 0.01, 0.3
DELAYS = [0.0, 0.5, 1.0, 1.5]
RATES = [(1, 1), (2, 10)]


@dataclass(frozen=True)
class Point:
    """An operating point: side of the contact (0: gap), moment at the output, total play, load friction."""

    name: str
    side: float
    moment_Nm: float
    play_rad: float = 0.02
    load_coefficient: float = 0.02


DRIVING, DRIVEN = Point("driving", 1.0, 0.0), Point("driven", -1.0, 2.0)
GAP = Point("gap", 0.0, LOAD_DRY + 0.01, 1e3)
SLIDING = Point("sliding", 1.0, LOAD_DRY, 0.0, 0.0)  # a spring without play: its torque passes zero


def variant(point: Point, delay: float, rates: tuple[int, int], **load: float) -> Design:
    design = drive_f()
    c = design.controller
    assert c.velocity is not None
    assert c.position is not None
    assert design.coupling is not None
    return replace(
        design,
        controller=replace(
            c,
            computing_delay_s=delay * c.period_s,
            velocity=replace(c.velocity, every=rates[0]),
            position=replace(c.position, every=rates[1]),
        ),
        friction=Friction(dry_torque_Nm=DRY, viscous_Nms_rad=1e-4, load_coefficient=point.load_coefficient),
        load=replace(design.load, friction=LoadFriction(dry_torque_Nm=LOAD_DRY, viscous_Nms_rad=1e-3)),
        coupling=replace(design.coupling, play_rad=point.play_rad),
    )


def cruise(design: Design, point: Point) -> tuple[State, dict[str, float]]:
    """State of steady motion at `SPEED`, for the running and for the linear drive."""
    motor, coupling = design.motor, design.coupling
    assert coupling is not None
    assert motor.resistance_ohm is not None
    assert motor.torque_constant_Nm_A is not None
    N = design.ratio_to_coupling
    torque = (LOAD_DRY + 1e-3 * SPEED / N - point.moment_Nm) * abs(point.side)
    share = 1 / N + point.side * design.friction.load_coefficient
    i = (DRY + 1e-4 * SPEED + share * torque) / motor.torque_constant_Nm_A
    u = motor.resistance_ohm * i + 0.05 * SPEED
    th = -SPEED / design.controller.position_loop.gain
    twist = torque / coupling.stiffness_Nm_rad
    state = State(
        motor_angle_rad=th, motor_speed_rad_s=SPEED, current_A=i, current_integral_V=u, velocity_integral=i,
        speed_command_rad_s=SPEED, current_command_A=i, voltage_V=u,
        output_angle_rad=th / N - twist - point.side * coupling.play_rad / 2,
    )  # fmt: skip
    linear = {"i": i, "w": SPEED, "th": th, "W": SPEED / N, "twist": twist, "velocity.I": i, "current.I": u}
    return state, linear | {"hold_w_ref": SPEED, "hold_i_ref": i, "u1": u, "u2": u}


def run_on_bias(design: Design, point: Point) -> tuple[Trajectory, dict[str, np.ndarray]]:
    """The same motion twice: simulated, and by control.forced_response of the assembled loops."""
    initial, known = cruise(design, point)
    run = simulate(
        design, commands.sine(0.03, 7.0), TICKS * design.controller.period_s, point.moment_Nm,
        bias=commands.ramp(SPEED / design.total_ratio), initial=initial,
    )  # fmt: skip
    system = assemble_loops(design, operating_point=point.name).tick_system
    x0 = system.initial_state({name: value for name, value in known.items() if name in system.states})
    n, count = system.ticks, TICKS // system.ticks
    load = np.full(count, point.moment_Nm - LOAD_DRY)
    inputs = np.vstack([run.reference_rad[::n], np.full(count, -DRY), load])
    times = np.arange(count) * (n * design.controller.period_s)
    outputs = control.forced_response(system.lifted(), times, inputs, x0).outputs
    outputs = outputs.reshape(n, len(system.outputs), -1)
    return run, {name: outputs[:, k, :].T.reshape(-1) for k, name in enumerate(system.outputs)}


def assert_identical(point: Point, delay: float, rates: tuple[int, int]) -> None:
    run, linear = run_on_bias(variant(point, delay, rates), point)
    assert run.output_speed_rad_s is not None
    assert run.coupling_torque_Nm is not None
    assert run.events == 0
    assert np.ptp(run.motor_speed_rad_s) > 5.0  # the motion is not trivial
    if point.play_rad == 0.0:
        assert np.ptp(np.sign(run.coupling_torque_Nm)) == 2.0
    else:
        assert (point.side * run.coupling_torque_Nm > 0.0).all() or point.side == 0.0
    simulated = {
        "th": run.motor_angle_rad,
        "w": run.motor_speed_rad_s,
        "i": run.current_A,
        "u": run.voltage_V,
        "i_ref": run.current_command_A,
        "w_ref": run.speed_command_rad_s,
        "W": run.output_speed_rad_s,
        "T_s": run.coupling_torque_Nm,
        "output_angle": run.output_angle_rad + point.side * point.play_rad / 2,
    }
    for name, values in simulated.items():
        expected = linear[name]
        assert np.abs(values - expected).max() <= 1e-9 * np.abs(expected).max(), name


@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize("delay", DELAYS)
def test_driving(delay: float, rates: tuple[int, int]) -> None:
    assert_identical(DRIVING, delay, rates)


@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize("delay", DELAYS)
def test_driven(delay: float, rates: tuple[int, int]) -> None:
    assert_identical(DRIVEN, delay, rates)


@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize("delay", DELAYS)
def test_in_the_gap(delay: float, rates: tuple[int, int]) -> None:
    assert_identical(GAP, delay, rates)


@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize("delay", DELAYS)
def test_sliding_on_a_spring_without_play(delay: float, rates: tuple[int, int]) -> None:
    assert_identical(SLIDING, delay, rates)
