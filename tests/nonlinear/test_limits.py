"""Limits alone: H1, H2, H3, anti-windup; any valid drive keeps its own."""

from math import acos, asin, degrees, inf, radians

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.design import model
from actuator_lti.design.checks import check_design
from actuator_lti.design.model import Design, Motor
from actuator_lti.errors import InputError
from nonlinear import Reducers, Run, State, commands, loads, simulate, simulate_many
from tests.changed import changed
from tests.validation.rich_drives import rich_drive

AMBER = load_design("ilr33-amber")


def ideal_drive(period_s: float, limits: model.Limits) -> model.Design:
    """Inner loops without lag: a torque source whose velocity loop reaches its command in one tick."""
    inertia, place = 1e-6, model.PositionLoop(gain=0.5 / period_s)
    velocity = model.VelocityLoop(gain=inertia / period_s)
    control = {"period_s": period_s, "computing_delay_s": 0.0, "position": place, "velocity": velocity}
    return model.Design(
        name="ideal",
        title="ideal inner loops",
        motor=model.Motor(rotor_inertia_kgm2=inertia, source_gain_Nm_V=1.0),
        controller=model.Controller(**control),
        limits=limits,
        validation=model.Validation(full_deflection_rad=1.0),
    )


def test_h1_pure_rate_limit() -> None:
    """10 deg at 5 Hz through 150 deg/s: triangle of 7.5 deg, fundamental 0.607927, lag 41.4096 deg."""
    Ts, f, A, R = 2e-8, 5.0, radians(10.0), radians(150.0)
    design = ideal_drive(Ts, model.Limits(voltage_V=inf, speed_rad_s=R))
    period = round(1.0 / (f * Ts))
    run = Run(
        design=design,
        # begun on the triangle, at its lower turning point
        command=commands.sine(A, f, phase_rad=-asin(0.75)),
        initial=State(motor_angle_rad=radians(-7.5), motor_speed_rad_s=-R, speed_command_rad_s=-R),
        duration_s=2.0 / f,
        reducers=Reducers(window_ticks=period),
    )
    result = simulate_many([run])
    low, high = result.span("output_angle_rad")
    response = result.phasor("output_angle_rad")[0] / result.phasor("reference_rad")[0]
    assert degrees(high[0]) == pytest.approx(7.5, abs=5e-4)
    assert degrees(low[0]) == pytest.approx(-7.5, abs=5e-4)
    assert abs(response) == pytest.approx(0.607927, abs=5e-7)
    # tick and hold put the turning point about one tick late
    assert -degrees(np.angle(response)) - 360.0 * f * Ts == pytest.approx(degrees(acos(0.75)), abs=5e-5)
    assert result.distortion("output_angle_rad")[0] == pytest.approx(0.121, abs=5e-4)
    assert result.limit_fraction("speed")[0] > 0.999


def test_h2_pure_acceleration_limit_and_h3_an_unsteady_point_shows() -> None:
    """20 000 deg/s2 at 20 Hz: parabola train of 1.5625 deg, fundamental 1.6126 deg."""
    Ts, f, a = 1e-6, 20.0, radians(20_000.0)
    design = ideal_drive(Ts, model.Limits(voltage_V=inf, acceleration_rad_s2=a))
    start = -a / (4.0 * f)
    begin, window = State(motor_speed_rad_s=start, speed_command_rad_s=start), round(1.0 / (f * Ts))
    asked = {"command": commands.sine(radians(1000.0), f), "duration_s": 2.0 / f, "initial": begin}
    run = Run(design=design, reducers=Reducers(window_ticks=window), **asked)
    result = simulate_many([run])
    low, high = result.span("output_angle_rad", last=1)
    assert degrees(high[0] - low[0]) / 2.0 == pytest.approx(1.5625, abs=5e-4)
    assert degrees(abs(result.phasor("output_angle_rad", last=1)[0])) == pytest.approx(1.6126, abs=5e-4)
    assert result.distortion("output_angle_rad", last=1)[0] == pytest.approx(0.038, abs=1e-3)
    asked = {"design": AMBER, "command": commands.sine(0.002, 10.0), "reducers": Reducers(window_ticks=1000)}
    runs = [Run(**asked, duration_s=duration_s) for duration_s in (0.2, 2.0)]
    early, late = simulate_many(runs).unsteadiness("output_angle_rad")
    assert early > 1e-3
    assert late < 1e-6


def test_voltage_saturation_leaves_no_windup() -> None:
    """A step on 3 V of supply: saturated half of the way, no more overshoot than the braking costs."""
    run = simulate(changed(AMBER, limits={"voltage_V": 3.0}), commands.step(0.1), 1.0)
    assert run.limits["voltage"].fraction > 0.2
    assert np.abs(run.voltage_V).max() <= 3.0
    assert run.output_angle_rad.max() < 0.1 * 1.01
    assert run.output_angle_rad[-1] == pytest.approx(0.1, rel=1e-3)


def drive(seed: int) -> Design:
    """Any stages and features over decades; one in four on an ideal torque source, which has no current."""
    design = rich_drive(600 + seed)
    if seed % 4 or design.supply is not None or design.controller.outermost == "current":
        return design
    limits = {"peak_current_A": inf, "continuous_current_A": inf, "peak_time_s": None}
    source = Motor(rotor_inertia_kgm2=design.motor.rotor_inertia_kgm2, source_gain_Nm_V=per_volt(design))
    return changed(design, motor=source, limits=limits, controller={"current": None})


def per_volt(design: Design) -> float:
    """Torque at standstill, N m/V."""
    motor = design.motor
    return motor.source_gain_Nm_V or motor.torque_constant_Nm_A / motor.resistance_ohm


@pytest.mark.parametrize("part", range(4))
def test_any_drive(part: int) -> None:
    tried = 0
    for seed in range(1 + 30 * part, 31 + 30 * part):
        design, rng = drive(seed), np.random.default_rng(seed)
        try:
            check_design(design, design.name)
        except InputError:  # features that exclude each other
            continue
        tried += 1
        c, limits, full = design.controller, design.limits, design.validation.full_deflection_rad
        outer = c.position or c.velocity
        updates = outer.every if outer else 1
        frequency = min(10.0 ** rng.uniform(-0.3, 2.3), 0.2 / (updates * c.period_s))
        command = commands.triangle(0.1 * full * 10.0 ** rng.uniform(-2.0, 2.0), frequency)
        load = rng.uniform(-0.3, 0.3) * per_volt(design) * limits.voltage_V * design.total_ratio
        moment = loads.proportional(rng.uniform(-0.3, 0.3) * load / full, load)
        run = simulate(design, command, 800 * c.period_s, moment, energy=True, raise_on_failure=False)
        assert run.status == "ok", (seed, run.advice)
        for name, values in run.columns().items():
            assert np.isfinite(values).all(), (seed, name)
        # the bus of a supply has its own law: test_wider_running
        assert design.supply or np.abs(run.voltage_V).max() <= limits.voltage_V, seed
        assert np.abs(run.current_command_A).max() <= limits.peak_current_A, seed
        if c.position and c.velocity:
            assert np.abs(run.speed_command_rad_s).max() <= limits.speed_rad_s, seed
            allowed = limits.acceleration_rad_s2 * updates * c.period_s
            assert np.abs(np.diff(run.speed_command_rad_s)).max() <= allowed * (1 + 1e-9), seed
        assert run.events_per_tick <= 50, seed
        assert design.friction.law == "tanh" or run.energy.relative_error < 1e-9, seed
    assert tried > 25
