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
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Literal

from actuator_lti.bounds import CAMPAIGN_RUNS
from actuator_lti.errors import InputError, in_file
from actuator_lti.files.reading import as_path, read_campaign_toml, shown_path
from analyses.records.naming import canonical, spelled
from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn
from analyses.request import key_of
from analyses.toml_tables import Table

RECORDS = (
    'CSV, JSON, Parquet or MATLAB, or a TOML with file = "log.csv" or [[record]]'
    "; correlate takes the design first, identify behind --design"
)
Method = Literal["correlation", "event", "given"]


@dataclass(frozen=True, kw_only=True)
class Instruments:
    """Bounds of the systematic errors, constant over a campaign, uniform within."""

    torque_full_scale_Nm: Annotated[float, "N*m"] = 10.0
    # of full scale: at zero and there, each on its own, with a straight line between
    torque_accuracy: Annotated[float, ""] = 0.0
    current_gain: Annotated[float, ""] = 0.0
    current_offset_A: Annotated[float, "A"] = 0.0
    torque_constant: Annotated[float, ""] = 0.0  # relative error of kM; 0: taken as known

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if value < 0.0:
                raise InputError(f"instruments.{key_of(name)} = {value}: must be 0 or more")


@dataclass(frozen=True, kw_only=True)
class RunEntry:
    """One run as listed: its files and its conditions. A load of exactly zero means: clutch disconnected."""

    id: str
    drive: Path
    sensor: Path | None = None
    speed_rad_s: Annotated[float | None, "rad/s"] = None
    load_Nm: Annotated[float | None, "N*m"] = None
    offset_s: Annotated[float | None, "s"] = None
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """A campaign file, read and checked; no record has been opened yet."""

    name: str = ""
    design: str = "ilr33-amber"
    outliers: Literal["keep", "set-aside"] = "keep"
    drive: RecordSpec
    sensor: RecordSpec | None
    join: Join
    instruments: Instruments
    runs: tuple[RunEntry, ...]
    origin: str


@dataclass(frozen=True, kw_only=True)
class Join:
    """How the two recorders are put on one clock, and the signals that show the shared happening."""

    method: Method = "correlation"
    drive_signal: str = "speed"
    sensor_signal: str = "torque"


def load_campaign(path: str | Path) -> Campaign:
    """Read a campaign file.

    Raises `InputError`: names the file, the key, its value and what is allowed.
    """
    path = as_path(path)
    root = records_table(path)
    root.only(("campaign", "drive", "sensor", "join", "instruments", "run"))
    head = root.table("campaign")
    with in_file(str(path)):
        campaign = head.read(
            Campaign,
            drive=record_spec(root.table("drive")),
            sensor=record_spec(root.table("sensor")) if "sensor" in root else None,
            join=root.table("join").read(Join),
            instruments=root.table("instruments").read(Instruments),
            runs=tuple(_run(table, path.parent) for table in root.tables("run")),
            origin=str(path),
        )
    campaign = campaign if "name" in head else replace(campaign, name=shown_path(path.stem))
    _check(campaign)
    return campaign


def records_table(path: Path) -> Table:
    """The file of a campaign or of records; a design is refused."""
    root = Table(read_campaign_toml(path), "", str(path))
    if {"motor", "design"} & set(root):
        raise InputError(f"a design, and no record; allowed: {RECORDS}", where=root.origin)
    return root


def _check(campaign: Campaign) -> None:
    if not campaign.runs:
        raise InputError("no [[run]] is listed", where=campaign.origin)
    CAMPAIGN_RUNS.check(len(campaign.runs), campaign.origin)
    identities = Counter(run.id for run in campaign.runs)
    lacking = {"current", "speed"} - {signal.name for signal in campaign.drive.signals}
    wrong = [f'run.id = "{identity}": given twice' for identity, times in identities.items() if times > 1]
    wrong += [f"drive.signals.{name}: is needed" for name in sorted(lacking)]
    if wrong:
        raise InputError(wrong[0], where=campaign.origin)


def _run(table: Table, folder: Path) -> RunEntry:
    entry = table.read(RunEntry)
    sensor = folder / entry.sensor if entry.sensor and table.data["sensor"] else None
    return replace(entry, drive=folder / entry.drive, sensor=sensor)


def record_spec(table: Table) -> RecordSpec:
    """A recorder's description: ``[drive]`` or ``[sensor]`` of a campaign, or a record file."""
    layout, parts = ({key_of(one.name) for one in fields(kind)} for kind in (CsvFormat, RecordSpec))
    try:
        return table.read(
            RecordSpec,
            beside={*layout, "time", "signals"},
            format=table.read(CsvFormat, beside=parts - {"format"}),
            time=_time(table.table("time")),
            signals=tuple(_signal(table.table("signals"), name) for name in table.table("signals")),
        )
    except InputError as error:
        if error.where is not None:
            raise
        raise InputError(table.key(error.message), where=table.origin) from None


def _time(table: Table) -> TimeColumn:
    usual = {} if {"period", "column"} & set(table) else {"column": "time"}
    return Table({**usual, **table.data}, table.path, table.origin).read(TimeColumn)


def _signal(signals: Table, name: str) -> SignalColumn:
    one = signals.table(name)
    made = Table({"column": name, **one.data}, one.path, one.origin).read(SignalColumn, name=name)
    unit = spelled(made.unit)
    return replace(made, name=canonical(name, unit), unit=unit)
