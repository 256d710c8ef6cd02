"""A bus voltage that varies over time: what the motor then has, in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti.design import load_design
from actuator_lti.design.model import Controller, Design, PositionLoop
from actuator_lti.errors import InputError
from nonlinear import commands, simulate

TICK = 1e-3
TIME = np.arange(0.0, 1.0, TICK)
BUS = 10.0 - 4.0 * TIME + 2.0 * np.sin(9.0 * TIME)


def _integrator(position: PositionLoop | None) -> Design:
    """An ideal torque source on an inertia without friction: w' = gain u / J."""
    base = load_design("ilr33-amber")
    motor = replace(
        base.motor, source_gain_Nm_V=0.002, resistance_ohm=None, inductance_H=None,
        torque_constant_Nm_A=None, back_emf_constant_Vs_rad=None, rotor_inertia_kgm2=1e-4,
    )  # fmt: skip
    friction = replace(base.friction, dry_torque_Nm=0.0, viscous_Nms_rad=0.0, load_coefficient=0.0)
    controller = Controller(period_s=TICK, computing_delay_s=0.0, position=position)
    limits = replace(
        base.limits, voltage_V=10.0, speed_rad_s=np.inf, acceleration_rad_s2=np.inf,
        peak_current_A=np.inf, continuous_current_A=np.inf,
    )  # fmt: skip
    return replace(
        base, motor=motor, friction=friction, controller=controller, limits=limits, requirements=()
    )


def _sampled_motion(design: Design, voltage_V: np.ndarray) -> np.ndarray:
    """Speed at the ticks under voltages held over them: the sum of what each tick adds."""
    gain = design.effective_motor.source_gain_Nm_V
    step = gain * TICK / design.inertia_kgm2
    return np.concatenate([[0.0], step * np.cumsum(voltage_V)[:-1]])


def test_the_bus_limits_the_voltage_at_each_tick() -> None:
    design = _integrator(None)
    wanted = 9.0 * np.sin(6.0 * TIME)
    run = simulate(design, commands.sampled(TIME, wanted), 1.0, supply=commands.sampled(TIME, BUS))
    applied = np.clip(wanted, -BUS, BUS)
    assert np.any(applied != wanted)
    np.testing.assert_allclose(run.voltage_V, applied, rtol=0, atol=1e-12)
    np.testing.assert_allclose(run.motor_speed_rad_s, _sampled_motion(design, applied), atol=1e-9)
    assert run.limits["voltage"].fraction == pytest.approx(np.mean(applied != wanted))


def test_a_duty_ratio_is_scaled_by_the_bus_between_the_loop_s_updates_too() -> None:
    """u = gain e held over four ticks, limited by the nominal 10 V; the motor has u U(t)/10 V each tick."""
    design = _integrator(PositionLoop(gain=0.5, every=4))
    command = commands.step(30.0 / design.total_ratio)
    run = simulate(design, command, 1.0, supply=commands.sampled(TIME, BUS), supply_scales=True)
    gain = design.effective_motor.source_gain_Nm_V
    angle = speed = held = 0.0
    a = gain / design.inertia_kgm2
    expected = np.empty(len(TIME))
    for k, bus in enumerate(BUS):
        if k % 4 == 0:
            held = float(np.clip(0.5 * (30.0 - angle), -10.0, 10.0))
        u = expected[k] = held * bus / 10.0
        angle += TICK * speed + 0.5 * TICK**2 * a * u
        speed += TICK * a * u
    assert run.limits["voltage"].fraction > 0.0
    np.testing.assert_allclose(run.voltage_V, expected, rtol=0, atol=1e-9)
    assert run.final.motor_angle_rad == pytest.approx(angle, rel=1e-9)


def test_a_constant_supply_at_the_nominal_voltage_changes_nothing() -> None:
    design = load_design("ilr33-amber")
    command = commands.step(0.05)
    nominal = commands.sampled([0.0, 0.1], [design.limits.voltage_V] * 2)
    plain, supplied = simulate(design, command, 0.1), simulate(design, command, 0.1, supply=nominal)
    np.testing.assert_array_equal(plain.output_angle_rad, supplied.output_angle_rad)
    np.testing.assert_array_equal(plain.limit_flags, supplied.limit_flags)


def test_a_supply_that_cannot_be_is_refused() -> None:
    design = load_design("ilr33-amber")
    series = commands.sampled([0.0, 0.1], [12.0, 11.0])
    with pytest.raises(InputError, match="without a current loop"):
        simulate(design, commands.hold(0.0), 0.1, supply=series, supply_scales=True)
    with pytest.raises(InputError, match="voltages of 0 or more"):
        simulate(design, commands.hold(0.0), 0.1, supply=commands.sampled([0.0, 0.1], [12.0, -1.0]))
    with pytest.raises(InputError, match="voltages of 0 or more"):
        simulate(design, commands.hold(0.0), 0.1, supply=commands.sine(12.0, 1.0))
