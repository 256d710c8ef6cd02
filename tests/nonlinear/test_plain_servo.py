"""The plain C program that the benchmark measures against does the same: an independent oracle."""

import shutil

import numpy as np
import pytest

from actuator_lti import load_design
from nonlinear import commands, loads, simulate


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate"])
@pytest.mark.parametrize("motion", [(5.0, 1.0, 4.0), (0.05, 10.0, 2.0), (10.0, 3.0, 0.0)])
def test_the_simulator_agrees_with_it(name: str, motion: tuple[float, float, float]) -> None:
    from benchmarks.plain_servo import PlainServo

    design, (size_deg, frequency_hz, load_Nm) = load_design(name), motion
    command, ticks = commands.sine(np.radians(size_deg), frequency_hz), 5000
    period = design.controller.period_s
    reference = design.total_ratio * command.values(period, ticks)
    history, events = PlainServo(design).run(reference, np.full(ticks, load_Nm))
    run = simulate(design, command, ticks * period, loads.constant(load_Nm))
    assert run.events == events
    ours = (run.motor_angle_rad, run.motor_speed_rad_s, run.current_A, run.voltage_V)
    for k, values in enumerate(ours):
        assert np.abs(history[:, k] - values).max() < 1e-9 * np.abs(values).max()
