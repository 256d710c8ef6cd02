"""The campaign file: which runs there are, how their files look, what the instruments can do.

::

    [campaign]
    name = "Bench, March"
    design = "ilr33-amber"          # kM and the reduction come from it

    [drive]                         # the drive's log, and the clock that all is put on
    separator = ";"
    decimal = ","
    time = { column = "tick", tick = "1 ms" }        # or { column = "t", unit = "s" }
    signals.current = { column = "I", unit = "mA" }
    signals.speed = { column = "n", unit = "rpm" }
    signals.angle = { column = "pos", unit = "deg" }

    [sensor]                        # the torque sensor's log, with a clock of its own
    signals.torque = { column = "M", unit = "N*m" }
    time = { column = "t", unit = "s" }

    [join]
    method = "correlation"          # or "event", "given" (with offset in each run)

    [instruments]                   # what the makers state; bounds, uniform within
    torque_full_scale = "10 N*m"
    torque_accuracy = "0.5 %"
    current_gain = "0.5 %"
    current_offset = "2 mA"

    [[run]]
    id = "01"
    drive = "run01_drive.csv"
    sensor = "run01_torque.csv"
    speed = "104.7 rad/s"
    load = "2 N*m"
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from actuator_lti.bounds import CAMPAIGN_RUNS
from actuator_lti.errors import InputError
from actuator_lti.reading import shown_path
from actuator_lti.tree import Tree
from analyses.records.naming import canonical
from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn
from analyses.records.toml_tables import Table, read_toml


@dataclass(frozen=True, kw_only=True)
class Instruments:
    """Bounds of the systematic errors, constant over a campaign, uniform within.

    ``torque_accuracy`` is a share of ``torque_full_scale_Nm`` and bounds the error at zero and at full scale,
    each on its own, with a straight line between. ``torque_constant_gain`` bounds the relative error of kM
    (0: taken as known).
    """

    torque_full_scale_Nm: float = 10.0
    torque_accuracy: float = 0.0
    current_gain: float = 0.0
    current_offset_A: float = 0.0
    torque_constant_gain: float = 0.0


@dataclass(frozen=True, kw_only=True)
class RunEntry:
    """One run as listed: its files and its conditions. A load of exactly zero means: clutch disconnected."""

    id: str
    drive: Path
    sensor: Path | None
    speed_rad_s: float | None
    load_Nm: float | None
    offset_s: float | None
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """A campaign file, read and checked; no record has been opened yet."""

    name: str
    design: str
    drive: RecordSpec
    sensor: RecordSpec | None
    join_method: str
    join_drive_signal: str
    join_sensor_signal: str
    instruments: Instruments
    runs: tuple[RunEntry, ...]
    origin: str
    outliers: str = "keep"
    notes: tuple[str, ...] = field(default=())


def load_campaign(path: str | Path) -> Campaign:
    """Read a campaign file.

    Raises
    ------
    InputError
        Names the file, the key, its value and what is allowed.
    """
    path = Path(path)
    root = Table(read_toml(path), "", str(path))
    head = root.table("campaign")
    runs = tuple(_run(table, path.parent) for table in root.tables("run"))
    join = root.table("join")
    campaign = Campaign(
        name=head.text("name", shown_path(path.stem)),
        design=head.text("design", "ilr33-amber"),
        outliers=head.text("outliers", "keep", ("keep", "set-aside")),
        drive=_spec(root.table("drive")),
        sensor=_spec(root.table("sensor")) if "sensor" in root else None,
        join_method=join.text("method", "correlation", ("correlation", "event", "given")),
        join_drive_signal=join.text("drive_signal", "speed"),
        join_sensor_signal=join.text("sensor_signal", "torque"),
        instruments=_instruments(root.table("instruments")),
        runs=runs,
        origin=str(path),
    )
    for table in (head, join, root):
        table.done()
    _check(campaign)
    return campaign


def _check(campaign: Campaign) -> None:
    if not campaign.runs:
        raise InputError("no [[run]] is listed", where=campaign.origin)
    CAMPAIGN_RUNS.check(len(campaign.runs), campaign.origin)
    for identity, times in Counter(run.id for run in campaign.runs).items():
        if times > 1:
            raise InputError(f'run.id = "{identity}": given twice', where=campaign.origin)
    for name in ("current", "speed"):
        if name not in {signal.name for signal in campaign.drive.signals}:
            raise InputError(f"drive.signals.{name}: is needed", where=campaign.origin)


def _run(table: Table, folder: Path) -> RunEntry:
    sensor = table.text("sensor", "")
    entry = RunEntry(
        id=table.text("id"),
        drive=folder / table.text("drive"),
        sensor=folder / sensor if sensor else None,
        speed_rad_s=table.quantity("speed", "rad/s"),
        load_Nm=table.quantity("load", "N*m"),
        offset_s=table.quantity("offset", "s"),
        note=table.text("note", ""),
    )
    table.done()
    return entry


def _instruments(table: Table) -> Instruments:
    result = {
        "torque_full_scale_Nm": table.quantity("torque_full_scale", "N*m", 10.0),
        "torque_accuracy": table.quantity("torque_accuracy", "", 0.0),
        "current_gain": table.quantity("current_gain", "", 0.0),
        "current_offset_A": table.quantity("current_offset", "A", 0.0),
        "torque_constant_gain": table.quantity("torque_constant", "", 0.0),
    }
    table.done()
    for name, value in result.items():
        if value is None or value < 0.0:
            raise InputError(f"instruments: {name} = {value}: must be 0 or more", where=table.origin)
    return Instruments(**{name: float(value or 0.0) for name, value in result.items()})


def _spec(table: Table) -> RecordSpec:
    """A recorder's description, ``[drive]`` or ``[sensor]``."""
    try:
        parts: Tree = {
            "format": _format(table),
            "time": _time(table.table("time")),
            "signals": _signals(table.table("signals")),
        }
        for name, default in (("bad_rows", "error"), ("missing", "drop"), ("disorder", "error")):
            more = ("interpolate",) if name == "missing" else ()
            parts[name] = table.text(name, default, ("error", "drop", *more))
        tolerance = table.quantity("resample_tolerance", "")
        if tolerance is not None:
            parts["resample_tolerance"] = tolerance
        table.done()
        return RecordSpec(**parts)
    except InputError as error:
        if error.where is not None:
            raise
        raise InputError(table.key(error.message), where=table.origin) from None


def record_spec(data: object, origin: str, path: str = "record") -> RecordSpec:
    """A recorder's description from a table of a TOML file."""
    return _spec(Table(data, path, origin))


def _format(table: Table) -> CsvFormat:
    names = table.texts("names")
    return CsvFormat(
        separator=table.text("separator", ","),
        decimal=table.text("decimal", "."),
        comment=table.text("comment", "#"),
        row_end=table.text("row_end", ""),
        header=table.flag("header", None),
        names=names,
        skip_lines=table.integer("skip_lines", 0),
        encoding=table.text("encoding", "utf-8"),
        matrix=table.text("matrix", ""),
    )


def _time(table: Table) -> TimeColumn:
    period = table.quantity("period", "s")
    column = None if period is not None and "column" not in table else table.column("column", "time")
    time = TimeColumn(
        column=column,
        unit=table.text("unit", "s"),
        tick_s=table.quantity("tick", "s"),
        wrap=table.number("wrap"),
        minimum=table.number("minimum"),
        period_s=period,
    )
    table.done()
    return time


def _signals(table: Table) -> tuple[SignalColumn, ...]:
    signals = []
    for name in table:
        one = table.table(name)
        unit = one.text("unit", "1")
        signals.append(
            SignalColumn(
                name=canonical(name, unit),
                column=one.column("column", name),
                unit=unit,
                scale=one.number("scale", 1.0) or 0.0,
                offset=one.number("offset", 0.0) or 0.0,
                value=one.text("value", "dc", ("dc", "rms", "peak")),
                between=one.text("between", "line-line", ("line-line", "phase")),
            )
        )
        one.done()
    return tuple(signals)
