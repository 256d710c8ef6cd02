"""The C program of the benchmark is the same algorithm: same motion, same events."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from actuator_lti import load_design
from nonlinear import commands, simulate
from nonlinear._kernels import layout
from nonlinear.parameters import design_row
from nonlinear.setup import Tables, put_signal


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate"])
def test_same_motion(name: str) -> None:
    from benchmarks.c_simulator import CSimulator

    design, command, ticks = load_design(name), commands.sine(0.0873, 1.0), 20_000
    row = design_row(design)
    row[layout.TICKS], row[layout.LOAD] = ticks, 4.0
    put_signal(row, layout.COMMAND, command, Tables())
    history, flags = np.zeros((8, ticks)), np.zeros(ticks, np.uint8)
    events = CSimulator().run(row, history, flags)
    run = simulate(design, command, ticks * design.controller.period_s, 4.0)
    assert events == run.events > 4
    assert np.array_equal(flags, run.limit_flags)
    for k, values in ((2, run.motor_speed_rad_s), (3, run.current_A), (7, run.motor_angle_rad)):
        assert np.abs(history[k] - values).max() < 1e-11 * np.abs(values).max()
