"""The C that the benchmark measures is the simulator, compiled with all that this machine can do."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from actuator_lti import load_design
from nonlinear import Rows, commands, simulate


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate"])
def test_same_bits(name: str) -> None:
    from benchmarks.c_simulator import CSimulator

    design, command, ticks = load_design(name), commands.sine(0.0873, 1.0), 20_000
    rows = Rows.of(design)
    rows["ticks"], rows["load"] = ticks, 4.0
    rows.sine("command", 0.0873, 1.0)
    history, flags = np.zeros((8, ticks)), np.zeros(ticks, np.uint16)
    assert CSimulator().run(rows.values[0], history, flags) == 0
    run = simulate(design, command, ticks * design.controller.period_s, 4.0)
    assert run.events > 4
    assert np.array_equal(flags, run.limit_flags)
    for k, values in ((2, run.motor_speed_rad_s), (3, run.current_A), (7, run.motor_angle_rad)):
        assert np.array_equal(history[k], values)
