"""The C program of the benchmark is the same algorithm: same motion, same events."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from actuator_lti import load_design
from nonlinear import Rows, commands, simulate


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate"])
def test_same_motion(name: str) -> None:
    from benchmarks.c_simulator import CSimulator

    design, command, ticks = load_design(name), commands.sine(0.0873, 1.0), 20_000
    rows = Rows.of(design)
    rows["ticks"], rows["load"] = ticks, 4.0
    rows.sine("command", 0.0873, 1.0)
    history, flags = np.zeros((8, ticks)), np.zeros(ticks, np.uint8)
    events = CSimulator().run(rows.values[0], history, flags)
    run = simulate(design, command, ticks * design.controller.period_s, 4.0)
    assert events == run.events > 4
    assert np.array_equal(flags, run.limit_flags)
    for k, values in ((2, run.motor_speed_rad_s), (3, run.current_A), (7, run.motor_angle_rad)):
        assert np.abs(history[k] - values).max() < 1e-11 * np.abs(values).max()
