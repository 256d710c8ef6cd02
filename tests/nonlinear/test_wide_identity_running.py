"""The wider drive without dry friction and limits is its sampled linear loop (model.md section 4)."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from test_controller import some_drive

from actuator_lti import assemble_loops
from actuator_lti.design.model import Command, Design, Friction, Limits
from nonlinear import Rows

TICKS = 300
SIGNALS = {"th": "motor_angle_rad", "w": "motor_speed_rad_s", "i": "current_A", "u": "voltage_V"}


def linear_drive(case: int) -> Design:
    """A random drive with all that is linear, back-drivable against a spring, at any computing delay."""
    rng = np.random.default_rng(case)
    design = some_drive(rng)
    delay = float(rng.choice([0.0, 0.5, 1.0, 1.5, 2.7])) * design.controller.period_s
    control, load = design.controller, replace(design.load, path="back-drivable")
    return replace(
        design,
        controller=replace(control, computing_delay_s=delay),
        friction=Friction(viscous_Nms_rad=2e-6),
        limits=Limits(voltage_V=1e12),
        load=replace(
            load,
            moment_slope_Nm_rad=float(rng.choice([0.0, -200.0])),
            moment_damping_Nms_rad=float(rng.choice([0.0, 3.0])),
        ),
        encoder=replace(design.encoder, counts_per_rev=None),
        output_encoder=replace(design.output_encoder, counts_per_rev=None),
        command=Command(filter_time_s=design.command.filter_time_s, filter_order=design.command.filter_order),
    )


@pytest.mark.parametrize("part", range(4))
def test_random_linear_drives(part: int) -> None:
    for case in range(1000 + 20 * part, 1020 + 20 * part):
        design = linear_drive(case)
        if design.controller.position is not None:
            position = replace(design.controller.position, friction_feedforward=0.0)
            design = replace(design, controller=replace(design.controller, position=position))
        rng, t = np.random.default_rng(case), np.arange(TICKS)
        command = np.sin(t * rng.uniform(0.01, 0.1)) + 1e-3 * t
        rows = Rows.of(design, limits_on=False)
        rows["ticks"], rows["load"] = TICKS, 3.0
        rows.series("command", command)
        with np.errstate(over="ignore", invalid="ignore"):
            run = rows.trajectory()
        system = assemble_loops(design).tick_system
        assert system is not None
        # the linear writing takes the command of a speed drive at the motor
        scale = design.total_ratio if design.controller.outermost == "velocity" else 1.0
        with np.errstate(over="ignore", invalid="ignore"):
            linear = system.respond(scale * command, 0.0, None, 3.0)
        for name, ours in SIGNALS.items():
            result = getattr(run, ours)
            # a loop may grow: as long as both are far from the end of the numbers
            some = np.maximum.accumulate(np.abs(linear["w"])) < 1e12
            error = np.abs(result - linear[name])[some].max() / np.abs(linear[name][some]).max()
            assert error < 1e-9, (case, name, error, design.controller)


def test_limits_of_the_random_drives_are_off() -> None:
    assert linear_drive(1000).limits.speed_rad_s == inf
