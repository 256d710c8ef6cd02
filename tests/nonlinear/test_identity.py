"""Model.md section 4: where no friction turns, no limit and no event acts, the running drive is the loop."""

from collections.abc import Mapping
from dataclasses import dataclass

import control
import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design
from actuator_lti.design.model import Design, Friction, LoadFriction
from nonlinear import State, Trajectory, commands, simulate
from tests.changed import changed
from tests.nonlinear.elastic_drive import drive_f

TICKS = 20_000
SPEED, SPRUNG_SPEED = 300.0, 100.0  # rad/s, motor: the motion of every run
DRY, LOAD_DRY = 0.01, 0.3
SIGNALS = {
    "th": "motor_angle_rad", "w": "motor_speed_rad_s", "i": "current_A", "u": "voltage_V",
    "i_ref": "current_command_A", "w_ref": "speed_command_rad_s", "output_angle": "output_angle_rad",
    "W": "output_speed_rad_s", "T_s": "coupling_torque_Nm",
}  # fmt: skip
DELAYS, RATES = (0.0, 0.5, 1.0, 1.5), ((1, 1), (2, 10))


def timed(design: Design, delay: float, rates: tuple[int, int], feedforward: float = 0.0) -> Design:
    """The design with a computing delay in ticks and the updates of its velocity and position loop."""
    late, velocity = delay * design.controller.period_s, {"every": rates[0]}
    position = {"every": rates[1], "feedforward": feedforward}
    control = {"computing_delay_s": late, "velocity": velocity, "position": position}
    return changed(design, controller=control)


def linear_run(
    design: Design, run: Trajectory, known: Mapping[str, float], torque: float, moment: float, **point: object
) -> dict[str, np.ndarray]:
    """The same motion by control.forced_response of the assembled loops, from the states that are known."""
    system = assemble_loops(design, **point).tick_system
    x0 = system.initial_state({name: value for name, value in known.items() if name in system.states})
    n, held = system.ticks, np.ones(TICKS // system.ticks)
    inputs = np.vstack([run.reference_rad[::n], torque * held, moment * held])
    times = np.arange(held.size) * (n * design.controller.period_s)
    outputs = control.forced_response(system.lifted(), times, inputs, x0).outputs
    outputs = outputs.reshape(n, len(system.outputs), -1)
    return {name: outputs[:, k, :].T.reshape(-1) for k, name in enumerate(system.outputs)}


def assert_identical(
    run: Trajectory, linear: Mapping[str, np.ndarray], moved: float, off: float = 0.0
) -> None:
    assert np.ptp(run.motor_speed_rad_s) > moved  # the motion is not trivial
    for name in SIGNALS.keys() & linear.keys():
        expected = linear[name]
        values = getattr(run, SIGNALS[name]) + (off if name == "output_angle" else 0.0)
        assert np.abs(values - expected).max() <= 1e-9 * np.abs(expected).max(), name


BY_DIFFERENCE = {"speed": "difference", "filter_time_s": 2e-4}
RIGID = [
    # delay, rates, feed-forward, encoder, friction and load, limits
    *((delay, rates, 0.0, {}, None, True) for delay in DELAYS for rates in RATES),
    (1.0, (1, 1), 0.0, {}, 4.0, True),
    (0.5, (2, 10), 0.0, {}, 4.0, True),
    (1.0, (1, 1), 0.0, {**BY_DIFFERENCE, "difference_samples": 1}, 0.0, False),
    (1.5, (2, 10), 0.0, {**BY_DIFFERENCE, "difference_samples": 3}, 0.0, False),
    (1.0, (2, 10), 0.2, {}, None, False),
]


@pytest.mark.parametrize(("delay", "rates", "feedforward", "encoder", "load_Nm", "limits"), RIGID)
def test_rigid(delay, rates, feedforward, encoder, load_Nm, limits) -> None:
    """The shipped rigid drive on a ramp with a sine upon it; with a load also its constant friction."""
    design = timed(load_design("ilr33-amber"), delay, rates, feedforward)
    design = changed(design, encoder={"counts_per_rev": None, **encoder})
    start, T_v = -SPEED / design.controller.position.gain, design.controller.velocity.every * 1e-4
    friction, load = load_Nm is not None, load_Nm or 0.0
    run = simulate(
        design, commands.sine(1.5e-3, 7.0), TICKS * 1e-4, load,
        bias=commands.ramp(SPEED / design.total_ratio),
        initial=State(motor_angle_rad=start, motor_speed_rad_s=SPEED, speed_command_rad_s=SPEED),
        friction_on=friction, limits_on=limits,
    )  # fmt: skip
    known = {"w": SPEED, "th": start, "speed.filter": SPEED, "acc": T_v * SPEED, "ref_prev": start}
    known |= {f"estimate.D{k}": k * T_v * SPEED for k in range(1, 4)}
    torque = -design.friction.dry_Nm(load) if friction else 0.0
    linear = linear_run(design, run, known, torque, 0.0, load_Nm=load)  # no load moment beside it
    assert (run.motor_speed_rad_s > 0).all()
    assert not any(use.active for use in run.limits.values())
    assert set(linear) < set(SIGNALS)
    assert_identical(run, linear, 100.0)


@dataclass(frozen=True)
class Point:
    """An operating point: side of the contact (0: gap), moment at the output, total play, load friction."""

    name: str
    side: float
    moment_Nm: float
    play_rad: float = 0.02
    load_coefficient: float = 0.02


POINTS = [
    Point("driving", 1.0, 0.0),
    Point("driven", -1.0, 2.0),
    Point("gap", 0.0, LOAD_DRY + 0.01, 1e3),
    Point("sliding", 1.0, LOAD_DRY, 0.0, 0.0),  # a spring without play: its torque passes zero
]


def cruise(design: Design, point: Point) -> tuple[State, dict[str, float], float, float]:
    """State of steady motion for running and linear drive; its twist, and that of the line there."""
    motor, coupling, N, w = design.motor, design.coupling, design.ratio_to_coupling, SPRUNG_SPEED
    torque = (LOAD_DRY + 1e-3 * w / N - point.moment_Nm) * abs(point.side)
    share = 1 / N + point.side * design.friction.load_coefficient
    i = (DRY + 1e-4 * w + share * torque) / motor.torque_constant_Nm_A
    u = motor.resistance_ohm * i + 0.05 * w
    th, twist = -w / design.controller.position_loop.gain, torque / coupling.stiffness_Nm_rad
    bent = twist + 0.5 * point.play_rad * point.side
    state = State(
        motor_angle_rad=th, motor_speed_rad_s=w, current_A=i, current_integral_V=u, velocity_integral=i,
        speed_command_rad_s=w, current_command_A=i, voltage_V=u,
        output_angle_rad=th / N - bent,
    )  # fmt: skip
    linear = {"i": i, "w": w, "th": th, "W": w / N, "twist": twist, "velocity.I": i, "current.I": u}
    return state, linear | {"hold_w_ref": w, "hold_i_ref": i, "u1": u, "u2": u}, bent, twist


@pytest.mark.parametrize(
    ("delay", "rates"), [(0.0, RATES[0]), (0.5, RATES[1]), (1.0, RATES[1]), (1.5, RATES[0])]
)
@pytest.mark.parametrize("point", POINTS, ids=lambda point: point.name)
def test_behind_a_coupling_between_its_events(point: Point, delay: float, rates: tuple[int, int]) -> None:
    friction = Friction(dry_torque_Nm=DRY, viscous_Nms_rad=1e-4, load_coefficient=point.load_coefficient)
    load = {"friction": LoadFriction(dry_torque_Nm=LOAD_DRY, viscous_Nms_rad=1e-3)}
    design = changed(
        timed(drive_f(), delay, rates), friction=friction, load=load, coupling={"play_rad": point.play_rad}
    )
    initial, known, bent, twist = cruise(design, point)
    bias = commands.ramp(SPRUNG_SPEED / design.total_ratio)
    duration = TICKS * design.controller.period_s
    run = simulate(design, commands.sine(0.03, 7.0), duration, point.moment_Nm, bias=bias, initial=initial)
    assert run.events == 0
    if point.play_rad == 0.0:
        assert np.ptp(np.sign(run.coupling_torque_Nm)) == 2.0
    else:
        assert (point.side * run.coupling_torque_Nm > 0.0).all() or point.side == 0.0
    at = {"operating_point": point.name, "twist_rad": bent}
    linear = linear_run(design, run, known, -DRY, point.moment_Nm - LOAD_DRY, **at)
    assert set(linear) == {*SIGNALS, "phi"}
    assert_identical(run, linear, 5.0, off=bent - twist)
