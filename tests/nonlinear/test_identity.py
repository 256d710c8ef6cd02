"""Model.md section 4: where no friction turns, no limit and no event acts, the running drive is the loop."""

from collections.abc import Mapping
from dataclasses import dataclass

import control
import numpy as np
import pytest

from actuator_lti import assemble_loops
from actuator_lti.design.model import Design, Friction, LoadFriction
from nonlinear import State, Trajectory, commands, simulate
from tests.changed import changed
from tests.loops.own_laws import laid_bare, same_run
from tests.nonlinear.elastic_drive import drive_f
from tests.validation.rich_drives import rich_drive

TICKS = 20_000
SPRUNG_SPEED = 100.0  # rad/s, motor: the motion of every run
DRY, LOAD_DRY = 0.01, 0.3
SIGNALS = {
    "th": "motor_angle_rad", "w": "motor_speed_rad_s", "i": "current_A", "u": "voltage_V",
    "i_ref": "current_command_A", "w_ref": "speed_command_rad_s", "output_angle": "output_angle_rad",
    "W": "output_speed_rad_s", "T_s": "coupling_torque_Nm",
}  # fmt: skip
RATES = ((1, 1), (2, 10))


def timed(design: Design, delay: float, rates: tuple[int, int]) -> Design:
    """The design with a computing delay in ticks and the updates of its velocity and position loop."""
    late, velocity = delay * design.controller.period_s, {"every": rates[0]}
    control = {"computing_delay_s": late, "velocity": velocity, "position": {"every": rates[1]}}
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


@pytest.mark.parametrize("seed", range(40))
def test_any_drive_on_its_own(seed: int) -> None:
    """Any stage outermost, any plant, delay, rates and speed estimate, any slot of the controller."""
    design = changed(laid_bare(rich_drive(seed, own_law=False)), friction={"load_coefficient": 0.0})
    same_run(design, seed, np.random.default_rng(seed))


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
    assert np.ptp(run.motor_speed_rad_s) > 5.0  # the motion is not trivial
    for name, ours in SIGNALS.items():
        values = getattr(run, ours) + (bent - twist if name == "output_angle" else 0.0)
        assert np.abs(values - linear[name]).max() <= 1e-9 * np.abs(linear[name]).max(), name
