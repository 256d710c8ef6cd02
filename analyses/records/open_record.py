"""A record by its file alone: a record file (TOML) that describes it, or a layout that is known."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from actuator_lti.errors import InputError
from actuator_lti.files.mat5 import MatContent
from actuator_lti.files.reading import open_regular, shown_path
from analyses.records.campaign_file import record_spec
from analyses.records.campaign_import import read_record
from analyses.records.csv_stream import MAX_ROWS
from analyses.records.inputs import spec_of_names
from analyses.records.mat_reader import columns_of, load_mat, names_in
from analyses.records.parquet_reader import load_parquet
from analyses.records.published import EMPS_SPEC, ODRIVE_SPEC
from analyses.records.record import Record
from analyses.records.spec import CsvFormat, RecordSpec
from analyses.toml_tables import Table, read_toml

HEAD_BYTES = 1 << 16
EMPS_COLUMNS = {"t", "qm", "qg", "vir", "gtau"}
_DECIMAL_COMMA = re.compile(r"(?:^|[;\t])\s*[+-]?[0-9]+,[0-9]")
UNKNOWN = (
    "the layout is not known (columns such as time_s, reference_deg, Current [mA] are); "
    "describe it in a record file (TOML), see actuator-lti correlate --help"
)


def open_record(path: str | Path, *, max_rows: int = MAX_ROWS) -> Record:
    """Read a record whose layout is told by a record file, or by its column names.

    Known without a record file: CSV (comma, semicolon or tab; decimal point or comma), Parquet and MATLAB
    files whose columns are named with their units, such as ``time_s``, ``reference_deg``,
    ``Motor speed [rpm]``, ``current_A``, ``load_Nm`` (what ``simulate`` writes); a MATLAB matrix beside a
    list of such names; the ODrive recorder's CSV; and the MATLAB file of the EMPS benchmark.

    A record file is TOML::

        file = "log.csv"                               # beside the record file
        separator = ";"
        decimal = ","
        time = { column = "t", unit = "ms" }
        signals.reference = { column = "cmd", unit = "deg" }
        signals.current = { column = "I", unit = "mA", value = "rms" }
        resample_tolerance = "2 %"                     # of the range, where steps are missing or uneven
        missing = "interpolate"                        # signals at several rates; default "drop" the row

    Raises
    ------
    InputError
        Names the file and what is wrong, or how to describe it.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix == ".toml":
        return _described(path, max_rows)
    if path.is_file() and path.stat().st_size == 0:
        raise InputError("is empty; allowed: a line of names, then rows of numbers", where=str(path))
    spec, why = _spec_of_file(path, suffix)
    record = read_record(path, spec, max_rows)
    inputs = tuple(
        one if one.signal else replace(one, note=why.get(one.column, one.note)) for one in record.inputs
    )
    return replace(_with_gain(record), name=shown_path(path.name), inputs=inputs)


def _described(path: Path, max_rows: int) -> Record:
    data = read_toml(path)
    if "file" not in data:
        kind = "a design" if {"motor", "design"} & set(data) else "a TOML file"
        raise InputError(
            f'{kind}, and no record; allowed: CSV, Parquet or MATLAB, or a TOML with file = "log.csv"'
            " (a design goes behind --design)",
            where=str(path),
        )
    if not isinstance(data["file"], str):
        raise Table(data, "", str(path)).fail("file", "a text is wanted")
    file = path.parent / data["file"]
    spec = record_spec({k: v for k, v in data.items() if k != "file"}, str(path), "")
    return replace(read_record(file, spec, max_rows), name=shown_path(file.name))


def _spec_of_file(path: Path, suffix: str) -> tuple[RecordSpec, Mapping[str, str]]:
    """The layout of a file from the names in it."""
    if suffix == ".mat":
        return _spec_of_mat(path)
    if suffix in (".parquet", ".pq"):
        spec, why = spec_of_names(tuple(load_parquet(path)[0]))
    else:
        head = _head(path)
        if head.startswith("%Motor characterization data"):
            return ODRIVE_SPEC, {}
        columns, layout = _columns_of_csv(head)
        spec, why = spec_of_names(columns, layout)
    if spec is None:
        raise InputError(_told(UNKNOWN, why), where=str(path))
    return spec, why


def _told(message: str, why: Mapping[str, str]) -> str:
    """A refusal with the first columns and why they are not understood."""
    first = "; ".join(f'"{column}": {reason}' for column, reason in list(why.items())[:4])
    return f"{message} ({first})" if first else message


def _spec_of_mat(path: Path) -> tuple[RecordSpec, Mapping[str, str]]:
    content, _ = load_mat(path)
    if set(content.arrays) >= EMPS_COLUMNS:
        return EMPS_SPEC, {}
    why: Mapping[str, str] = {}
    for layout in _layouts(content):
        spec, why = spec_of_names(tuple(columns_of(content, layout, path)), layout)
        if spec is not None:
            return spec, why
    raise InputError(_told(UNKNOWN, why), where=str(path))


def _layouts(content: MatContent) -> list[CsvFormat]:
    """Vectors by name, then each matrix that has a list of names beside it."""
    wide = [(name, values.shape) for name, values in content.arrays.items() if min(values.shape) > 1]
    named = [(name, names_in(content, shape[1])) for name, shape in wide if len(shape) == 2]
    return [CsvFormat(), *(CsvFormat(matrix=name, names=names) for name, names in named if names)]


def _with_gain(record: Record) -> Record:
    """The force of an EMPS record, from the gain that the file holds."""
    gain = record.constants.get("gtau")
    if gain is None or "voltage" not in record.signals:
        return record
    signals = {**record.signals, "force": gain * record["voltage"]}
    return replace(record, signals=signals, units={**record.units, "force": "N"})


def _head(path: Path) -> str:
    with open_regular(path, "record") as stream:
        return stream.read(HEAD_BYTES).decode("utf-8-sig", errors="replace")


def _columns_of_csv(head: str) -> tuple[tuple[str, ...], CsvFormat]:
    """Column names, separator and decimal mark from the first lines of a file."""
    lines = [line for line in (row.strip("\r\n") for row in head.split("\n")) if line.strip()]
    lines = [line for line in lines if not line.lstrip().startswith("#")]
    header = lines[0] if lines else ""
    separator = max(";\t,", key=lambda mark: (header.count(mark), mark == ","))
    comma = separator != "," and any(_DECIMAL_COMMA.search(line) for line in lines[1:50])
    try:
        cells = next(csv.reader([header], delimiter=separator), [])
    except csv.Error:
        cells = []
    columns = tuple(cell.strip() for cell in cells)
    return columns, CsvFormat(separator=separator, decimal="," if comma else ".")
