"""A record by its file alone: a record file (TOML) that describes it, or a layout that is known."""

import csv
import re
from collections.abc import Mapping
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

from actuator_lti.errors import InputError
from actuator_lti.files.matlab import MatContent
from actuator_lti.files.reading import UTF_16, as_path, open_regular, shown, shown_path
from analyses.records.campaign_file import RECORDS, record_spec, records_table
from analyses.records.csv_stream import STAMP, text_of
from analyses.records.inputs import spec_of_names
from analyses.records.naming import is_unit
from analyses.records.readers import Held, columns_of, held_in, names_in, read_record
from analyses.records.record import Record
from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn
from analyses.toml_tables import Table

EMPS_SPEC = RecordSpec(
    time=TimeColumn(column="t"),
    signals=(
        SignalColumn(name="position", column="qm", unit="m"),
        SignalColumn(name="position_reference", column="qg", unit="m"),
        SignalColumn(name="voltage", column="vir", unit="V"),
    ),
)
ODRIVE_SPEC = RecordSpec(
    format=CsvFormat(comment="%", row_end=";", names=("timestep", "voltage", "position", "velocity")),
    time=TimeColumn(column="timestep", tick_s=1.0 / 8000.0, minimum=1.0),
    signals=(
        SignalColumn(name="voltage", column="voltage", unit="V"),
        SignalColumn(name="angle", column="position", unit="turn"),
        SignalColumn(name="speed", column="velocity", unit="turn/s"),
    ),
)
BESIDE = ("file", "settings", "signals")
BY_ROW = ("bad_rows", "missing", "disorder", "resample_tolerance")  # keys that describe no column
HEAD_BYTES = 1 << 16
PACKED = (b"\x1f\x8b", b"PK", b"BZ", b"\xfd7")
EMPS_COLUMNS = {"t", "qm", "qg", "vir", "gtau"}
_DECIMAL_COMMA = re.compile(r"(?:^|[;\t])\s*[+-]?[0-9]+,[0-9]")
UNKNOWN = (
    "the layout is not known (columns such as time_s, reference_deg, Current [mA] are); "
    "describe it in a record file (TOML; column = its name, or its number from 1), see actuator-lti "
    "correlate --help"
)


def open_record(path: str | Path) -> Record:
    """As `open_records`, of a file that holds one record."""
    records = open_records(path)
    if len(records) != 1:
        raise InputError(f"lists {len(records)} records; allowed here: one", where=str(path))
    return records[0]


def open_records(path: str | Path) -> list[Record]:
    """Read the records whose layout is told by a record file, or the one of a file by its column names.

    Known without a record file: CSV (comma, semicolon or tab; decimal point or comma; units in the names or
    in a row of their own; time in seconds or as ISO 8601 stamps), JSON, Parquet and MATLAB files whose
    columns are named with their units, such as ``time_s``, ``reference_deg``, ``Motor speed [rpm]``,
    ``current_A``, ``load_Nm`` (what ``simulate`` writes); a MATLAB matrix beside a list of such names; the
    ODrive recorder's CSV; and the MATLAB file of the EMPS benchmark.

    A record file is TOML: ``docs/records.md`` says what it may hold. Several records stand in ``[[record]]``
    tables, each with what is its own beside what all share.

    Raises `InputError`: names the file and what is wrong, or how to describe it.
    """
    path = as_path(path)
    if path.suffix.lower() == ".toml":
        return _described(path)
    if not path.suffix and not path.exists():  # as designs are named
        raise InputError(f"is no file; allowed: {RECORDS}", where=str(path))
    if path.is_file() and path.stat().st_size == 0:
        raise InputError("is empty; allowed: a line of names, then rows of numbers", where=str(path))
    spec, why = _spec_of_file(path, held := held_in(path))
    record = read_record(path, spec, held)
    gain = record.constants.get("gtau")
    if gain is not None and "voltage" in record.signals:  # the force of an EMPS record
        signals = {**record.signals, "force": gain * record["voltage"]}
        record = replace(record, signals=signals, units={**record.units, "force": "N"})
    notes = ("" if one.signal else why.get(one.column, "") for one in record.inputs)
    pairs = zip(record.inputs, notes, strict=True)
    return [replace(record, inputs=tuple(replace(one, note=note or one.note) for one, note in pairs))]


def _described(path: Path) -> list[Record]:
    root = records_table(path)
    if not {"file", "record"} & set(root):
        raise InputError(f"a TOML file, and no record; allowed: {RECORDS}", where=str(path))
    shared = {key: value for key, value in root.data.items() if key != "record"}
    result: list[Record] = []
    for one in root.tables("record") if "record" in root else [Table({}, "", str(path))]:
        signals = {**root.table("signals").data, **one.table("signals").data}
        own = Table({**shared, **one.data, "signals": signals}, one.path, one.origin)
        settings = {**_settings(root.table("settings")), **_settings(one.table("settings"))}
        files = own.data.get("file")
        names: list[Any] = files if isinstance(files, list) and files else [files]
        if not all(isinstance(name, str) for name in names):
            raise own.fail("file", "a text, or a list of texts, is wanted")
        settings_notes = tuple(f"set: {key} = {value}" for key, value in settings.items())
        read = (_read_by_settings(path.parent / name, own) for name in names)
        result += [replace(one, settings=settings, notes=(*one.notes, *settings_notes)) for one in read]
    return result


def _read_by_settings(path: Path, own: Table) -> Record:
    """A file as its table says; where that describes no column, the columns' own names do."""
    if own.data["signals"] or not set(own) <= {*BESIDE, *BY_ROW}:
        rest = {key: value for key, value in own.data.items() if key not in ("file", "settings")}
        return read_record(path, record_spec(Table(rest, own.path, own.origin)))
    known, _ = _spec_of_file(path, held := held_in(path))
    given = {key: getattr(known, key) for key in ("format", "time", "signals")}
    return read_record(path, own.read(RecordSpec, beside=BESIDE, **given), held)


def _settings(table: Table) -> dict[str, str | float]:
    """Keys of a design by their dotted names."""
    found: dict[str, str | float] = {}
    for name, value in table.data.items():
        if isinstance(value, Mapping):
            found |= {f"{name}.{key}": one for key, one in _settings(table.table(name)).items()}
        elif isinstance(value, str | int | float) and not isinstance(value, bool):
            found[name] = value
        else:
            raise table.fail(name, "a key of the design with its value is wanted")
    return found


def _spec_of_file(path: Path, held: Held) -> tuple[RecordSpec, Mapping[str, str]]:
    """The layout of a file from the names in it; for each column that is not read: why."""
    spec: RecordSpec | None = None
    why: Mapping[str, str] = {}
    content = None if held is None else held[0]
    if isinstance(content, MatContent):
        if set(content.arrays) >= EMPS_COLUMNS:
            return EMPS_SPEC, {}
        named = {key: names_in(content, one.shape[1]) for key, one in content.arrays.items() if one.ndim == 2}
        wide = [key for key, names in named.items() if names and min(content.arrays[key].shape) > 1]
        layouts = iter([CsvFormat(), *(CsvFormat(matrix=key, names=named[key]) for key in wide)])
        # vectors by name, then each matrix with names
        while spec is None and (layout := next(layouts, None)):
            spec, why = spec_of_names(tuple(columns_of(content, layout, path)), layout)
    elif content is not None:
        spec, why = spec_of_names(tuple(content))
    else:
        with open_regular(path, "record") as stream:
            data = stream.read(HEAD_BYTES)
        if data[:2] not in UTF_16 and (b"\0" in data or data[:2] in PACKED):
            raise InputError("is no text but binary or packed; allowed: " + RECORDS, where=shown_path(path))
        head = text_of(data[: data.rfind(b"\n") + 1] or data).removeprefix("\ufeff")  # of whole lines
        if head.startswith("%Motor characterization data"):
            return _odrive_spec(head), {}
        columns, layout = _columns_of_csv(head)
        spec, why = spec_of_names(columns, layout)
    if spec is None:
        first = "; ".join(f"{shown(column)}: {reason}" for column, reason in list(why.items())[:20])
        raise InputError(f"{UNKNOWN} ({first})" if first else UNKNOWN, where=str(path))
    return spec, why


def _odrive_spec(head: str) -> RecordSpec:
    """The recorder's layout, where its last two comments name its columns in their order and their units."""
    lines = [line.removeprefix("%").split(",") for line in head.splitlines() if line.startswith("%")]
    names = tuple(cell.partition(" (")[0].strip().lower() for cell in lines[-2:][0])
    units = dict(zip(names, (cell.strip(" []").replace("turns", "turn") for cell in lines[-1]), strict=False))
    if not set(ODRIVE_SPEC.format.names) == set(names) == set(units):
        return ODRIVE_SPEC
    signals = tuple(replace(one, unit=units[str(one.column)]) for one in ODRIVE_SPEC.signals)
    return replace(ODRIVE_SPEC, format=replace(ODRIVE_SPEC.format, names=names), signals=signals)


def _columns_of_csv(head: str) -> tuple[tuple[str, ...], CsvFormat]:
    """Column names, separator and decimal mark from the first lines of a file.

    Units in a row of their own below the names, and seconds of time stamps, are put behind the names.
    """
    lines = [(k, line.strip("\r\n")) for k, line in enumerate(head.split("\n"), 1)]
    lines = [(k, line) for k, line in lines if line.strip() and not line.lstrip().startswith("#")]
    at, header = lines[0] if lines else (0, "")
    separator = max(";\t,", key=lambda mark: (header.count(mark), mark == ","))
    comma = separator != "," and any(_DECIMAL_COMMA.search(line) for _, line in lines[1:50])
    columns = _cells(header, separator)
    rows = [(k, _cells(line, separator)) for k, line in lines[1:3]]
    units = tuple(cell.strip("[]()- ") for cell in rows[0][1]) if rows else ()
    if any(unit.strip("1") for unit in units) and all(not unit or is_unit(unit) for unit in units):
        at, _ = rows.pop(0)
    else:
        units = ()
    stamps = [STAMP.fullmatch(cell.encode()) is not None for cell in rows[0][1]] if rows else []
    read_units = [unit or ("s" if stamp else "") for unit, stamp in zip_longest(units, stamps, fillvalue="")]
    names = tuple(f"{name} [{unit}]" if unit else name for name, unit in zip_longest(columns, read_units))
    layout = CsvFormat(separator=separator, decimal="," if comma else ".", stamps=any(stamps))
    if names == columns or len(read_units) != len(columns):
        return columns, layout
    return names, replace(layout, names=names, skip_lines=at)


def _cells(line: str, separator: str) -> tuple[str, ...]:
    try:
        return tuple(cell.strip() for cell in next(csv.reader([line], delimiter=separator), []))
    except csv.Error:
        return ()
