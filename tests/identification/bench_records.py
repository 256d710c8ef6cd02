"""Records whose truth is known: simulated motions, written as a recorder would."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from actuator_lti.design import load_design
from actuator_lti.design.model import Design
from nonlinear import Trajectory, commands, simulate

Columns = dict[str, np.ndarray]
NOISE_A = 0.02


class Ran(NamedTuple):
    """A command's status and what it printed."""

    status: int
    out: str
    err: str

    @property
    def data(self) -> Any:
        """Its JSON."""
        return json.loads(self.out)


Command = Callable[..., Ran]


def motion(seed: int, *, load_Nm: float = 0.0, design: Design | None = None) -> Trajectory:
    """A multisine of 20 mrad at the output over 4 s: both directions, to the speed limit."""
    drive = load_design("ilr33-amber") if design is None else design
    command = commands.multisine(0.02, [0.7, 1.9, 4.3], 4.0, 1e-4, seed=seed)
    return simulate(drive, command, 4.0, load_Nm)


def columns_of(run: Trajectory, seed: int = 0, load_Nm: float | None = None) -> Columns:
    """Columns at 1 kHz in a recorder's units, the current with white noise of 20 mA."""
    every = slice(None, None, 10)
    noise = NOISE_A * np.random.default_rng(seed).standard_normal(len(run.time_s[every]))
    columns = {
        "time_s": run.time_s[every],
        "reference_deg": np.degrees(run.reference_rad[every]),
        "motor_angle_rad": run.motor_angle_rad[every],
        "motor_speed_rpm": run.motor_speed_rad_s[every] * 30.0 / np.pi,
        "current_A": run.current_A[every] + noise,
    }
    if load_Nm is not None:
        columns["load_Nm"] = np.full(len(noise), load_Nm)
    return columns


def write(
    path: Path,
    columns: Columns,
    change: Callable[[Columns], Columns] | None = None,
    mark: str = ",",
    fmt: str = "%.12g",
) -> Path:
    """A CSV file with a header line."""
    columns = columns if change is None else change(dict(columns))
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=mark, header=mark.join(columns), comments="", fmt=fmt)
    return path


def staircase(*speeds: float) -> Trajectory:
    """One direction, a second at each motor speed."""
    drive = load_design("ilr33-amber")
    time = np.arange(0.0, 1.3 * len(speeds) + 0.5, 1e-3)
    knots, levels = [0.0, 0.2], [0.0, 0.0]
    for k, speed in enumerate(speeds):
        knots += [1.3 * k + 0.5, 1.3 * k + 1.5]
        levels += [speed, speed]
    speed = np.interp(time, knots, levels)
    angle = np.concatenate([[0.0], np.cumsum(speed[:-1] * 1e-3)]) / drive.total_ratio
    return simulate(drive, commands.sampled(time, angle), float(time[-1]))
