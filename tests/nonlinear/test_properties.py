"""Any valid drive: no NaN, no hang, bounded events, limits kept, energy in balance."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from actuator_lti.design.checks import check_design
from actuator_lti.design.model import Design, Motor
from actuator_lti.errors import InputError
from nonlinear import commands, loads, simulate
from tests.validation.random_drives import full_drive


def drive(seed: int) -> Design:
    """Any stages and features over decades; one in four on an ideal torque source, which has no current."""
    design = full_drive(seed)
    motor, supply = design.motor, design.supply
    if seed % 4 == 0 and supply is None and design.controller.outermost != "current":
        source = Motor(
            rotor_inertia_kgm2=motor.rotor_inertia_kgm2,
            source_gain_Nm_V=motor.torque_constant_Nm_A / motor.resistance_ohm,
        )
        limits = replace(design.limits, peak_current_A=inf, continuous_current_A=inf, peak_time_s=None)
        control = replace(design.controller, current=None)
        return replace(design, motor=source, limits=limits, controller=control)
    return design


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
        gain = (
            design.motor.source_gain_Nm_V or design.motor.torque_constant_Nm_A / design.motor.resistance_ohm
        )
        load = rng.uniform(-0.3, 0.3) * gain * limits.voltage_V * design.total_ratio
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
