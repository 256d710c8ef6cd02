"""A stage that locks itself before the coupling (model.md section 6); a bus voltage that varies over time."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from actuator_lti import InputError, load_design, plant
from actuator_lti.design import Design, design_hash, read_design_text, with_overrides, write_design
from actuator_lti.design.model import Controller, Friction, Limits, Motor, PositionLoop
from nonlinear import commands, simulate

AMBER = load_design("ilr33-amber")
RATIOS = {"planetary": 66, "worm": 36, "chain": 2}
CHAIN = {
    "gear": [{"name": name, "ratio": ratio} for name, ratio in RATIOS.items()],
    "coupling": {"stiffness": "50 N*m/rad", "damping": "0.3 N*m*s/rad", "after": "worm"},
    "load.inertia": "4e-3 kg*m^2",
}


def steering(**changes: str) -> Design:
    return with_overrides(AMBER, {**CHAIN, "load.locking_gear": "worm", **changes})


def test_a_worm_before_a_chain_is_accepted_and_the_last_gear_is_meant_where_nothing_is_said() -> None:
    design = steering()
    assert (design.ratio_to_coupling, design.ratio_behind_coupling) == (2376.0, 2.0)
    again = read_design_text(write_design(design), design.origin)
    assert again == design
    assert design_hash(again) == design_hash(design)
    for wrong, words in (
        ({}, "coupling.after.*before the self-locking stage; allowed: chain"),
        ({"load.locking_gear": "chain"}, "before the self-locking stage"),
        ({"load.locking_gear": "bevel"}, "load.locking_gear.*is no gear; allowed: planetary, worm, chain"),
        ({"load.locking_gear": "worm", "friction.load_coefficient": 0.9 / 4752}, "gives energy"),
        ({"load.locking_gear": "worm", "load.path": "back-drivable"}, "load.locking_gear = .*self-locking"),
    ):
        with pytest.raises(InputError, match=words):
            with_overrides(AMBER, {**CHAIN, **wrong})


@pytest.mark.parametrize(("load_Nm", "point"), [(4.0, "driving"), (-4.0, "driven")])
def test_the_motor_feels_the_load_as_friction_only(load_Nm: float, point: str) -> None:
    """At a constant speed T_s = -M/N_r, and kM i = C0 + CM N_r |T_s| + Cv w = C0 + CM |M| + Cv w.

    Of the linear one dw/dt = ... -+ CM N_r k twist/J_m, by the side on which the coupling is pressed.
    """
    design, rate = steering(), radians(5.0)
    run = simulate(design, commands.ramp(rate_rad_s=rate), 1.0, load_Nm=load_Nm)
    friction, kM = design.friction, design.motor.torque_constant_Nm_A
    w, CM = rate * design.total_ratio, friction.load_coefficient
    wanted = (friction.dry_torque_Nm + CM * 4.0 + friction.viscous_Nms_rad * w) / kM
    assert np.mean(run.current_A[int(0.8 * len(run.time_s)) :]) == pytest.approx(wanted, rel=1e-6)
    twist = run.motor_angle_rad[-1] / 2376.0 - 2.0 * run.output_angle_rad[-1]
    assert twist == pytest.approx(-load_Nm / 2.0 / 50.0, rel=1e-6)
    system = plant(design, "ideal", operating_point=point)
    entry = system.A[system.state_labels.index("w"), system.state_labels.index("twist")]
    felt = np.sign(load_Nm) * CM * 2.0 * 50.0 / design.motor_side_inertia_kgm2
    assert entry == pytest.approx(-felt, rel=1e-12)


TICK = 1e-3
TIME = np.arange(0.0, 1.0, TICK)
BUS = 10.0 - 4.0 * TIME + 2.0 * np.sin(9.0 * TIME)


def _integrator(position: PositionLoop | None) -> Design:
    """An ideal torque source on an inertia without friction: w' = gain u / J."""
    return replace(
        AMBER, motor=Motor(rotor_inertia_kgm2=1e-4, source_gain_Nm_V=0.002), friction=Friction(),
        controller=Controller(period_s=TICK, computing_delay_s=0.0, position=position),
        limits=Limits(voltage_V=10.0), requirements=(),
    )  # fmt: skip


def test_the_bus_limits_the_voltage_at_each_tick_and_a_constant_one_changes_nothing() -> None:
    design = _integrator(None)
    wanted = 9.0 * np.sin(6.0 * TIME)
    run = simulate(design, commands.sampled(TIME, wanted), 1.0, supply=commands.sampled(TIME, BUS))
    applied = np.clip(wanted, -BUS, BUS)
    assert np.any(applied != wanted)
    np.testing.assert_allclose(run.voltage_V, applied, rtol=0, atol=1e-12)
    step = design.effective_motor.source_gain_Nm_V * TICK / design.inertia_kgm2  # of a volt over a tick
    speed = np.concatenate([[0.0], step * np.cumsum(applied)[:-1]])
    np.testing.assert_allclose(run.motor_speed_rad_s, speed, atol=1e-9)
    assert run.limits["voltage"].fraction == pytest.approx(np.mean(applied != wanted))
    command, nominal = commands.step(0.05), commands.sampled([0.0, 0.1], [AMBER.limits.voltage_V] * 2)
    plain, supplied = simulate(AMBER, command, 0.1), simulate(AMBER, command, 0.1, supply=nominal)
    np.testing.assert_array_equal(plain.output_angle_rad, supplied.output_angle_rad)
    np.testing.assert_array_equal(plain.limit_flags, supplied.limit_flags)


def test_a_duty_ratio_is_scaled_by_the_bus_between_the_loop_s_updates_too() -> None:
    """u = gain e held over four ticks, limited by the nominal 10 V; the motor has u U(t)/10 V each tick."""
    design = _integrator(PositionLoop(gain=0.5, every=4))
    command = commands.step(30.0 / design.total_ratio)
    run = simulate(design, command, 1.0, supply=commands.sampled(TIME, BUS), supply_scales=True)
    angle = speed = held = 0.0
    a = design.effective_motor.source_gain_Nm_V / design.inertia_kgm2
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
    series = commands.sampled([0.0, 0.1], [12.0, 11.0])
    with pytest.raises(InputError, match="without a current loop"):
        simulate(AMBER, commands.hold(0.0), 0.1, supply=series, supply_scales=True)
    for negative in (commands.sampled([0.0, 0.1], [12.0, -1.0]), commands.sine(12.0, 1.0)):
        with pytest.raises(InputError, match="voltages of 0 or more"):
            simulate(AMBER, commands.hold(0.0), 0.1, supply=negative)
