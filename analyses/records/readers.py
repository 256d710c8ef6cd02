"""Files of named columns (Parquet, JSON, MATLAB up to 7.2), and a record of any file by its ending."""

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti.bounds import CSV_COLUMNS, MAT_BYTES, TABLE_BYTES, TABLE_ROWS, Bound
from actuator_lti.errors import InputError, in_file
from actuator_lti.files.matlab import MatContent, read_mat
from actuator_lti.files.reading import decode, parse_json, read_bytes, shown_path
from actuator_lti.start.extras import need
from actuator_lti.types import Floats
from analyses.records.csv_stream import read_csv_record
from analyses.records.record import Record
from analyses.records.spec import CsvFormat, RecordSpec
from analyses.records.table_record import record_of_columns


def _parquet(data: bytes, where: str) -> Mapping[str, Floats]:
    """The columns of numbers by name, NaN where a value is missing."""
    need("pyarrow", "tables", "a Parquet file")
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        file = pq.ParquetFile(BytesIO(data))
        TABLE_ROWS.check(file.metadata.num_rows, where)
        CSV_COLUMNS.check(file.metadata.num_columns, where)
        table = file.read()
    except (OSError, pa.ArrowException, UnicodeDecodeError) as error:  # the last of names of columns
        raise InputError(f"is no Parquet file: {error}", where=where) from None
    result = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        if pa.types.is_integer(column.type) or pa.types.is_floating(column.type):
            result[name] = np.asarray(column.cast(pa.float64(), safe=False), dtype=np.float64)
        elif pa.types.is_timestamp(column.type):
            stamps = column.cast(pa.timestamp("ns")).to_numpy()
            since = (stamps - stamps[:1]) / np.timedelta64(1, "ns")
            result[f"{name} [s]"] = 1e-9 * np.asarray(since, dtype=np.float64)
    return result


def _json(data: bytes, where: str) -> Mapping[str, Floats]:
    """The columns of numbers by name (``group.name`` in groups), NaN for null."""
    tree = parse_json(decode(data, where), where)
    if isinstance(tree, list) and all(isinstance(row, dict) for row in tree):
        names = dict.fromkeys(name for row in tree for name in row)
        CSV_COLUMNS.check(len(names), where)
        tree = {name: [row.get(name) for row in tree] for name in names}
    if not isinstance(tree, dict):
        raise InputError("no record; allowed: columns by name, or a list of rows by name", where=where)
    return dict(_columns(tree, ""))


def _columns(tree: Mapping[str, Any], group: str) -> Iterator[tuple[str, Floats]]:
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _columns(value, f"{group}{name}.")
        elif isinstance(value, list) and {type(one) for one in value} <= {int, float, type(None)}:
            yield group + name, np.array(value, dtype=np.float64)


def _mat(data: bytes, where: str) -> MatContent:
    """The content of a file, without its empty arrays."""
    with in_file(where):
        content = read_mat(data)
    content.arrays = {key: value for key, value in content.arrays.items() if value.size}
    return content


def columns_of(content: MatContent, layout: CsvFormat, path: Path) -> Mapping[str, Floats]:
    """The vectors of a file by name; where the layout names a matrix, its columns.

    The columns of a matrix are named by the layout's ``names``, or by the only list of texts in the file
    that has as many entries.
    """
    if not layout.matrix:
        return {key: value for key, value in content.arrays.items() if value.size > 1}
    matrix = content.arrays.get(layout.matrix)
    if matrix is None or matrix.ndim != 2:
        there = ", ".join(f'"{k}" {"x".join(map(str, v.shape))}' for k, v in content.arrays.items()) or "none"
        raise InputError(f'matrix = "{layout.matrix}": no such matrix; there are: {there}', where=str(path))
    names, count = layout.names or names_in(content, matrix.shape[1]), matrix.shape[1]
    if len(names) != count:
        why = f"has {count} columns, {len(names)} names are given: names = [...] must name each"
        raise InputError(f'matrix "{layout.matrix}" {why}', where=str(path))
    return dict(zip(names, matrix.T, strict=True))


def names_in(content: MatContent, count: int) -> tuple[str, ...]:
    """The only list of so many texts in a file; empty where there is none or more than one."""
    lists = [texts for texts in content.texts.values() if len(texts) == count]
    return tuple(lists[0]) if len(lists) == 1 else ()


_WHOLE: Mapping[str, tuple[str, Bound, Callable[[bytes, str], MatContent | Mapping[str, Floats]]]] = {
    ".mat": (".mat file", MAT_BYTES, _mat),
    ".json": ("JSON record", TABLE_BYTES, _json),
    **dict.fromkeys((".parquet", ".pq"), ("Parquet file", TABLE_BYTES, _parquet)),
}
"""Kinds of files that are read whole, by their ending: name, most bytes, reader."""
Held = tuple[MatContent | Mapping[str, Floats], str] | None
"""What a file holds that is read whole, and its SHA-256; None of one that is read row by row."""


def held_in(path: Path) -> Held:
    if (kind := _WHOLE.get(path.suffix.lower())) is None:
        return None
    what, most, read = kind
    data = read_bytes(path, what, most)
    return read(data, shown_path(path)), hashlib.sha256(data).hexdigest()


def read_record(path: Path, spec: RecordSpec, held: Held = None) -> Record:
    """A record of any kind, by the file's ending; scalars of a MATLAB file become ``constants``.

    Its columns are variable names (``group.field`` for those of a structure), or columns of the matrix that
    ``spec.format.matrix`` names. ``held``: what the file holds, where that is read already.
    """
    if (held := held or held_in(path)) is None:
        return read_csv_record(path, spec)
    content, digest = held
    if not isinstance(content, MatContent):
        return record_of_columns(content, spec, path, digest)
    constants = {k: float(v.ravel()[0]) for k, v in content.arrays.items() if v.size == 1}
    record = record_of_columns(columns_of(content, spec.format, path), spec, path, digest)
    return replace(record, constants=constants)
