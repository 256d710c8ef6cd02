"""Model.md section 4: while the speed keeps its sign, the simulator is the sampled linear loop."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design
from actuator_lti.design.model import Design
from nonlinear import State, Trajectory, commands, simulate

TICKS = 20_000
SPEED = 300.0  # rad/s, motor: the bias motion of every run
RATES = [(1, 1), (2, 10)]
DELAYS = [0.0, 0.5, 1.0, 1.5]


def variant(delay: float, rates: tuple[int, int], feedforward: float = 0.0, **encoder: object) -> Design:
    design = load_design("ilr33-amber")
    c = design.controller
    assert c.velocity is not None
    return replace(
        design,
        controller=replace(
            c,
            computing_delay_s=delay * c.period_s,
            velocity=replace(c.velocity, every=rates[0]),
            position=replace(c.position, every=rates[1], feedforward=feedforward),
        ),
        encoder=replace(design.encoder, counts_per_rev=None, **encoder),
    )


def run_on_bias(
    design: Design, *, friction_on: bool, load_Nm: float = 0.0, limits_on: bool = True
) -> tuple[Trajectory, dict[str, np.ndarray]]:
    """The same motion twice: simulated, and by control.forced_response of the assembled loops."""
    start = -SPEED / design.controller.position.gain
    bias = commands.ramp(SPEED / design.total_ratio)
    signal = commands.sine(1.5e-3, 7.0)
    duration = TICKS * design.controller.period_s
    initial = State(motor_angle_rad=start, motor_speed_rad_s=SPEED, speed_command_rad_s=SPEED)
    run = simulate(
        design, signal, duration, load_Nm, bias=bias, initial=initial, friction_on=friction_on,
        limits_on=limits_on,
    )  # fmt: skip
    system = assemble_loops(design, load_Nm=load_Nm).tick_system
    T_v = design.controller.velocity.every * design.controller.period_s
    known = {"w": SPEED, "th": start, "speed.filter": SPEED, "acc": T_v * SPEED, "ref_prev": start}
    past = [name for name in system.states if name.startswith("estimate.D")]
    known |= {name: int(name.removeprefix("estimate.D")) * T_v * SPEED for name in past}
    x0 = system.initial_state({name: value for name, value in known.items() if name in system.states})
    lifted = system.lifted()
    n = system.ticks
    torque = -design.friction.dry_Nm(load_Nm) if friction_on else 0.0
    held = np.ones(TICKS // n)
    inputs = np.vstack([run.reference_rad[::n], torque * held, 0.0 * held])  # no load moment beside it
    times = np.arange(TICKS // n) * (n * design.controller.period_s)
    response = control.forced_response(lifted, times, inputs, x0)
    outputs = response.outputs.reshape(n, len(system.outputs), -1)
    return run, {
        name: outputs[:, k, :].T.reshape(-1) for k, name in enumerate(system.outputs)
    }  # fmt: skip


def assert_identical(run: Trajectory, linear: dict[str, np.ndarray]) -> None:
    simulated = {
        "th": run.motor_angle_rad,
        "w": run.motor_speed_rad_s,
        "i": run.current_A,
        "u": run.voltage_V,
        "i_ref": run.current_command_A,
        "w_ref": run.speed_command_rad_s,
        "output_angle": run.output_angle_rad,
    }
    assert (run.motor_speed_rad_s > 0).all()
    assert not any(use.active for use in run.limits.values())
    assert np.ptp(run.motor_speed_rad_s) > 100.0  # the motion is not trivial
    for name, expected in linear.items():
        error = np.abs(simulated[name] - expected).max() / np.abs(expected).max()
        assert error < 1e-9, name


@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize("delay", DELAYS)
def test_without_dry_friction(delay: float, rates: tuple[int, int]) -> None:
    assert_identical(*run_on_bias(variant(delay, rates), friction_on=False))


@pytest.mark.parametrize(("delay", "rates"), [(1.0, (1, 1)), (0.5, (2, 10))])
def test_with_constant_friction_torque(delay: float, rates: tuple[int, int]) -> None:
    assert_identical(*run_on_bias(variant(delay, rates), friction_on=True, load_Nm=4.0))


@pytest.mark.parametrize(("delay", "rates", "samples"), [(1.0, (1, 1), 1), (1.5, (2, 10), 3)])
def test_with_speed_by_difference(delay: float, rates: tuple[int, int], samples: int) -> None:
    design = variant(delay, rates, speed="difference", difference_samples=samples, filter_time_s=2e-4)
    assert_identical(*run_on_bias(design, friction_on=True, limits_on=False))


def test_with_feedforward() -> None:
    assert_identical(*run_on_bias(variant(1.0, (2, 10), feedforward=0.2), friction_on=False, limits_on=False))
