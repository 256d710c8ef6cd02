"""A record by its file alone: a record file (TOML) that describes it, or a layout that is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from actuator_lti.errors import InputError
from analyses.records.campaign_file import record_spec
from analyses.records.campaign_import import read_record
from analyses.records.csv_stream import MAX_ROWS
from analyses.records.record import Record
from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn
from analyses.records.toml_tables import Table, read_toml

BASES = {
    "reference": "reference",
    "position_reference": "position_reference",
    "output_angle": "output_angle",
    "motor_angle": "angle",
    "angle": "angle",
    "motor_speed": "speed",
    "speed": "speed",
    "current": "current",
    "voltage": "voltage",
    "torque": "torque",
    "load": "torque",
    "supply": "supply",
    "force": "force",
    "position": "position",
    "velocity": "velocity",
}
SUFFIXES = {
    "rad": "rad", "deg": "deg", "rev": "rev", "m": "m", "mm": "mm",
    "A": "A", "mA": "mA", "V": "V", "N": "N", "Nm": "N*m",
    "rad_s": "rad/s", "deg_s": "deg/s", "rpm": "rpm", "rev_s": "rev/s", "m_s": "m/s", "mm_s": "mm/s",
}  # fmt: skip
LINEAR = {"reference": "position_reference", "output_angle": "position", "speed": "velocity", "angle": ""}
"""What a trajectory of a linear axis calls its signals; its motor angle is the position once more."""


def open_record(path: str | Path, *, max_rows: int = MAX_ROWS) -> Record:
    """Read a record whose layout is told by a record file, or is one of those known.

    Known without a record file: a CSV file (comma, point) with column names such as ``time_s``,
    ``reference_deg``, ``motor_speed_rad_s``, ``current_A``, ``load_Nm`` (what ``simulate`` writes); the
    ODrive recorder's CSV; and the MATLAB file of the EMPS benchmark.

    A record file is TOML::

        file = "log.csv"                               # beside the record file
        separator = ";"
        decimal = ","
        time = { column = "t", unit = "ms" }
        signals.reference = { column = "cmd", unit = "deg" }
        signals.current = { column = "I", unit = "mA" }

    Raises
    ------
    InputError
        Names the file and what is wrong, or how to describe it.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix == ".toml":
        return _described(path, max_rows)
    if suffix == ".mat":
        from analyses.identification.emps import EMPS_SPEC

        return replace(_with_gain(read_record(path, EMPS_SPEC, max_rows)), name=path.name)
    return read_record(path, _spec_of_csv(path), max_rows)


def _described(path: Path, max_rows: int) -> Record:
    data = read_toml(path)
    table = Table(data, "", str(path))
    file = path.parent / table.text("file")
    spec = record_spec({k: v for k, v in data.items() if k != "file"}, str(path), "")
    return replace(read_record(file, spec, max_rows), name=file.name)


def _with_gain(record: Record) -> Record:
    """The force of an EMPS record, from the gain that the file holds."""
    gain = record.constants.get("gtau")
    if gain is None or "voltage" not in record.signals:
        return record
    signals = {**record.signals, "force": gain * record["voltage"]}
    return replace(record, signals=signals, units={**record.units, "force": "N"})


def _spec_of_csv(path: Path) -> RecordSpec:
    """The layout of a CSV file from its first lines."""
    try:
        with path.open("rb") as stream:
            head = stream.read(1 << 16).decode("utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", where=str(path)) from None
    if head.startswith("%Motor characterization data"):
        from analyses.correlation.voltage_motor import ODRIVE_SPEC

        return ODRIVE_SPEC
    lines = (line.strip() for line in head.splitlines())
    header = next((line for line in lines if line and not line.startswith("#")), "")
    columns = [cell.strip().strip('"') for cell in header.split(",")]
    signals: dict[str, SignalColumn] = {}
    for column in columns:
        found = _signal(column)
        if found is not None:
            signals.setdefault(found.name, found)
    if "time_s" not in columns or not signals:
        raise InputError(
            "the layout is not known (columns such as time_s, reference_deg, current_A are); "
            "describe it in a record file (TOML), see actuator-lti correlate --help",
            where=str(path),
        )
    return RecordSpec(format=CsvFormat(), time=TimeColumn(column="time_s"), signals=tuple(signals.values()))


def _signal(column: str) -> SignalColumn | None:
    """The signal that a column name means, from its first words and the unit at its end.

    Examples
    --------
    >>> _signal("motor_speed_rpm")
    SignalColumn(name='speed', column='motor_speed_rpm', unit='rpm', scale=1.0, offset=0.0)
    """
    for base in sorted(BASES, key=len, reverse=True):
        suffix = column.removeprefix(f"{base}_")
        if suffix != column and suffix in SUFFIXES:
            unit = SUFFIXES[suffix]
            name = BASES[base]
            if unit in ("m", "mm", "m/s", "mm/s"):
                name = LINEAR.get(name, name)
            return SignalColumn(name=name, column=column, unit=unit) if name else None
    return None
