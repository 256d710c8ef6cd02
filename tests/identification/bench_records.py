"""Records whose truth is known: simulated motions, written as a recorder would."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from actuator_lti.design import load_design, model
from actuator_lti.design.asked import FrozenMap
from analyses.estimation.fit import Fit
from analyses.identification.verdict import Identified, Item
from analyses.records.record import Record, RowCounts
from nonlinear import Trajectory, commands, simulate
from tests.changed import changed
from tests.loops.loop_designs import drive_d

Columns = dict[str, np.ndarray]
NOISE_A = 0.02


def bare(name: str) -> model.Design:
    """A shipped design without what is told of its values."""
    return replace(load_design(name), parameters=FrozenMap({}), requirements=(), correlations=(), facts=())


def motion(seed: int, *, load_Nm: float = 0.0, design: model.Design | None = None) -> Trajectory:
    """A multisine of 20 mrad at the output over 4 s: both directions, to the speed limit."""
    drive = load_design("ilr33-amber") if design is None else design
    command = commands.multisine(0.02, [0.7, 1.9, 4.3], 4.0, 1e-4, seed=seed)
    return simulate(drive, command, 4.0, load_Nm)


def signals_of(run: Trajectory, seed: int) -> Columns:
    """What is seen at 1 kHz, in SI, the current with white noise of 20 mA."""
    signals = {
        "time": run.time_s, "reference": run.reference_rad, "angle": run.motor_angle_rad,
        "speed": run.motor_speed_rad_s, "current": run.current_A, "voltage": run.voltage_V,
    }  # fmt: skip
    table = {name: values[::10] for name, values in signals.items()}
    noise = NOISE_A * np.random.default_rng(seed).standard_normal(len(table["time"]))
    return {**table, "current": table["current"] + noise}


def columns_of(run: Trajectory, seed: int = 0, load_Nm: float | None = None) -> Columns:
    """The same in a recorder's units, without the voltage."""
    seen = signals_of(run, seed)
    columns = {
        "time_s": seen["time"],
        "reference_deg": np.degrees(seen["reference"]),
        "motor_angle_rad": seen["angle"],
        "motor_speed_rpm": seen["speed"] * 30.0 / np.pi,
        "current_A": seen["current"],
    }
    return columns if load_Nm is None else {**columns, "load_Nm": np.full(len(seen["time"]), load_Nm)}


def record_of(time: np.ndarray, name: str = "r", **signals: np.ndarray) -> Record:
    """A record in memory, signals in SI."""
    rows = RowCounts(rows_in=len(time), rows_out=len(time))
    return Record(name=name, time_s=time, signals=signals, units={}, counts=rows)


def errors_off(fit: Fit, truth: Mapping[str, float]) -> float:
    """By how many of its standard errors the value that is furthest off is; those that were found count."""
    return max(abs(fit[name] - truth[name]) / fit.std(name) for name in truth if name in fit.names)


def item_of(result: Identified, id: str) -> Item:
    """The one item of an identification that has an id."""
    (item,) = (one for one in result.items if one.id == id)
    return item


def write(path: Path, columns: Columns, mark: str = ",", fmt: str = "%.12g") -> Path:
    """A CSV file with a header line."""
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


HALF_PLAY = 1e-3


def two_mass_design() -> model.Design:
    """Drive D with 2 mrad of play, dry friction, encoders of 16 and 20 bits, 30 mA rms and 5 mA steps."""
    tools = model.Instruments(current_noise_A=0.03, current_resolution_A=0.005, output_angle_noise_rad=5e-6)
    current = model.CurrentLoop(gain_V_A=5.0, integral_time_s=2e-3)
    return changed(
        drive_d(), name="two-mass", motor={"resistance_ohm": 1.0, "inductance_H": 2e-3},
        controller={"velocity": None, "current": current}, load={"friction": {"viscous_Nms_rad": 0.02}},
        limits={"speed_rad_s": 900.0, "peak_current_A": 30.0, "continuous_current_A": 30.0},
        friction={"dry_torque_Nm": 0.004}, coupling={"play_rad": 2.0 * HALF_PLAY}, instruments=tools,
        encoder={"counts_per_rev": 65536}, output_encoder={"counts_per_rev": 1 << 20},
    )  # fmt: skip
