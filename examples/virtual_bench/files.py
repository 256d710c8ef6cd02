"""The files of the virtual bench: logs as a drive and a torque sensor write them, and the campaign file."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np

from actuator_lti.files.atomic import write_bytes
from analyses.records.record import Record
from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn
from examples.virtual_bench.instruments import BenchInstruments, RunLogs

LOG_TICK_S = 1e-3
DRIVE_SPEC = RecordSpec(
    format=CsvFormat(separator=";", decimal=",", comment="#"),
    time=TimeColumn(column="Tick", tick_s=LOG_TICK_S),
    signals=(
        SignalColumn(name="current", column="Current", unit="mA"),
        SignalColumn(name="speed", column="Speed", unit="rpm"),
        SignalColumn(name="angle", column="Position", unit="rev", scale=1.0 / 1024.0),
    ),
)
SENSOR_SPEC = RecordSpec(
    format=CsvFormat(separator=",", decimal=".", comment="#"),
    time=TimeColumn(column="time"),
    signals=(SignalColumn(name="torque", column="torque", unit="N*m"),),
)
_HEAD = """\
# Written by the virtual bench: simulated runs, seed {seed}.
[campaign]
name = "virtual bench, seed {seed}"
design = {design}

[drive]
separator = ";"
decimal = ","
time = {{ column = "Tick", tick = "1 ms" }}
signals.current = {{ column = "Current", unit = "mA" }}
signals.speed = {{ column = "Speed", unit = "rpm" }}
signals.angle = {{ column = "Position", unit = "rev", scale = {count:.17g} }}

[sensor]
time = {{ column = "time", unit = "s" }}
signals.torque = {{ column = "torque", unit = "N*m" }}

[join]
method = "correlation"

[instruments]
torque_full_scale = "{full:g} N*m"
torque_accuracy = {accuracy:g}
current_gain = {gain:g}
current_offset = "{offset:g} A"
torque_constant = {constant:g}
"""
_RUN = """
[[run]]
id = "{id}"
drive = "run{id}_drive.csv"
sensor = "run{id}_torque.csv"
speed = "{speed:.6g} rad/s"
load = "{load:g} N*m"
"""


def write_bench(
    folder: str | Path,
    logs: tuple[RunLogs, ...],
    *,
    design: str,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write the logs and, last, ``campaign.toml``, whose path comes back: it names only whole files."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    bounds = BenchInstruments().bounds
    for k, log in enumerate(logs, 1):
        write_bytes(folder / f"run{log.id}_drive.csv", _drive_text(log.drive))
        write_bytes(folder / f"run{log.id}_torque.csv", _sensor_text(log.sensor))
        if progress is not None:
            progress(k, len(logs))
    head = _HEAD.format(
        seed=seed,
        design='"' + design.replace("\\", "\\\\").replace('"', '\\"') + '"',
        count=1.0 / 1024.0,
        full=bounds.torque_full_scale_Nm,
        accuracy=bounds.torque_accuracy,
        gain=bounds.current_gain,
        offset=bounds.current_offset_A,
        constant=bounds.torque_constant,
    )
    parts = [_RUN.format(id=g.id, speed=g.speed_setting_rad_s, load=g.load_setting_Nm) for g in logs]
    path = folder / "campaign.toml"
    write_bytes(path, (head + "".join(parts)).encode())
    return path


RECORD_COLUMNS = {
    "current_reference": "current_command_A",
    "current": "current_A",
    "angle": "motor_angle_rad",
    "output_angle": "output_angle_rad",
}


def write_record(path: str | Path, record: Record) -> None:
    """Write a record of the two-mass bench as CSV with units in the header."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    names = [name for name in RECORD_COLUMNS if name in record.signals]
    header = ",".join(["time_s", *(RECORD_COLUMNS[name] for name in names)])
    columns = [record.time_s, *(record[name] for name in names)]
    text = _csv(columns, ("%.9g",) + ("%.12g",) * len(names), ",")
    write_bytes(path, f"{header}\n{text}".encode())


def _drive_text(record: Record) -> bytes:
    """Tick counter, mA, rpm, counts; semicolons and decimal commas, as a drive of German make writes."""
    columns = [
        np.round(record.time_s / LOG_TICK_S),
        record["current"] * 1e3,
        record["speed"] * 30.0 / np.pi,
        np.round(record["angle"] * 1024.0 / (2.0 * np.pi)),
    ]
    text = _csv(columns, ("%.0f", "%.0f", "%.4f", "%.0f"), ";").replace(".", ",")
    return ("# drive log\nTick;Current;Speed;Position\n" + text).encode()


def _sensor_text(record: Record) -> bytes:
    text = _csv([record.time_s, record["torque"]], ("%.4f", "%.3f"), ",")
    return ("# torque sensor log\ntime,torque\n" + text).encode()


def _csv(columns: list[np.ndarray], formats: tuple[str, ...], separator: str) -> str:
    out = io.StringIO()
    np.savetxt(out, np.column_stack(columns), fmt=list(formats), delimiter=separator)
    return out.getvalue()
