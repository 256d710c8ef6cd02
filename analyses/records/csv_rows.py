"""The head of a CSV file, and its text into rows of numbers: fast where clean, else line by line."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.start.extras import need
from analyses.estimation.arrays import FloatArray, IntArray
from analyses.records.record import RowCounts
from analyses.records.spec import MISSING_TEXTS, CsvFormat, RecordSpec

_RUN_OF_BLANKS = re.compile(rb"[ \t]+")
STAMP = re.compile(rb"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d)(?:[.,](\d+))?(Z|[+-]\d\d:?\d\d)?")
"""A time stamp of ISO 8601: to the second, its fraction, its zone."""


@dataclass(frozen=True, kw_only=True)
class Columns:
    """The columns of a file by name, and the positions (from 0) of those that are wanted."""

    header: tuple[str, ...]
    positions: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Block:
    """Numbers of the wanted columns, shape (n, columns), NaN where missing, and the file line of each row."""

    values: FloatArray
    lines: IntArray


def clean(data: bytes, layout: CsvFormat, counts: RowCounts) -> bytes:
    """Line ends to newline, row ends cut off, runs of blanks to one tab, time stamps to seconds."""
    if layout.stamps:
        data = STAMP.sub(lambda stamp: _seconds(stamp, layout, counts), data)
    data = data.replace(b"\r\n", b"\n")
    if layout.separator == "whitespace":
        data = _RUN_OF_BLANKS.sub(b"\t", data).replace(b"\n\t", b"\n").replace(b"\t\n", b"\n").lstrip(b"\t")
    if layout.row_end:
        end = layout.row_end.encode(layout.encoding)
        data = data.replace(end + b"\n", b"\n").removesuffix(end)
    return data


def _seconds(stamp: re.Match[bytes], layout: CsvFormat, counts: RowCounts) -> bytes:
    """Seconds from the first stamp's whole second, all digits of the fraction kept; UTC without a zone."""
    try:
        read = datetime.fromisoformat((stamp[1] + (stamp[3] or b"")).decode())
    except ValueError:
        return stamp[0]
    read = read if read.tzinfo else read.replace(tzinfo=UTC)
    counts.first_stamp = counts.first_stamp or read
    whole = (read - counts.first_stamp).total_seconds()
    return f"{whole:.0f}{layout.decimal}{(stamp[2] or b'0').decode()}".encode()


def _separator(layout: CsvFormat) -> str:
    """The one that stands in cleaned text."""
    return "\t" if layout.separator == "whitespace" else layout.separator


def fast_rows(data: bytes, first_line: int, columns: Columns, layout: CsvFormat) -> Block | None:
    """A whole cleaned block through Arrow's reader; None where any line needs a closer look."""
    need("pyarrow", "tables", "a record")
    import pyarrow as pa
    import pyarrow.csv as pc

    if layout.comment and layout.comment.encode(layout.encoding) in data:
        return None
    lines = data.count(b"\n") + (not data.endswith(b"\n"))
    names = [str(position) for position in range(len(columns.header))]
    wanted = list(dict.fromkeys(names[position] for position in columns.positions))
    convert = pc.ConvertOptions(
        column_types=dict.fromkeys(wanted, pa.float64()),
        include_columns=wanted,
        null_values=list(MISSING_TEXTS),
        decimal_point=layout.decimal,
    )
    parse = pc.ParseOptions(delimiter=_separator(layout), quote_char=False, ignore_empty_lines=False)
    read = pc.ReadOptions(column_names=names, use_threads=False, block_size=len(data) + 1)
    try:
        table = pc.read_csv(pa.BufferReader(data), read, parse, convert)
    except (pa.ArrowException, UnicodeDecodeError):
        return None
    values = np.column_stack([table.column(names[position]).to_numpy() for position in columns.positions])
    missing = np.isnan(values).all(axis=1).any()
    if table.num_rows != lines or missing or np.isinf(values).any():
        return None
    return Block(values=values, lines=np.arange(first_line, first_line + lines))


def careful_rows(
    data: bytes, first_line: int, columns: Columns, spec: RecordSpec, counts: RowCounts, origin: str
) -> Block:
    """A cleaned block line by line: comments and blanks counted, every faulty row named or dropped."""
    layout = spec.format
    text = data.decode(layout.encoding, errors="replace")
    rows, numbers = [], []
    for number, line in enumerate(text.removesuffix("\n").split("\n"), first_line):
        stripped = line.strip()
        if not stripped:
            counts.blanks += 1
        elif layout.comment and stripped.startswith(layout.comment):
            counts.comments += 1
        else:
            counts.rows_in += 1
            try:
                rows.append(_row(line, columns, layout))
                numbers.append(number)
            except ValueError as error:
                if spec.bad_rows == "error":
                    raise InputError(str(error), where=f"{origin}:{number}") from None
                counts.drop("not a row of numbers", f"line {number}, {error}")
    values = np.array(rows, dtype=np.float64).reshape(len(rows), len(columns.positions))
    return Block(values=values, lines=np.array(numbers, dtype=np.int64))


def _row(line: str, columns: Columns, layout: CsvFormat) -> list[float]:
    cells = line.split(_separator(layout))
    if len(cells) != len(columns.header):
        raise ValueError(f"{len(cells)} columns where {len(columns.header)} are expected")
    return [_number(cells[k], columns.header[k], layout.decimal) for k in columns.positions]


def _number(cell: str, name: str, decimal: str) -> float:
    text = cell.strip().strip('"').strip()
    if text in MISSING_TEXTS:
        return math.nan
    try:
        if "_" in text or (decimal == "," and "." in text):
            raise ValueError(text)
        value = float(text.replace(",", ".") if decimal == "," else text)
    except ValueError:
        told = f'column "{name}" = "{text[:40]}": not a number (decimal mark "{decimal}")'
        raise ValueError(told) from None
    if not math.isfinite(value):
        raise ValueError(f'column "{name}" = "{text[:40]}": not finite')
    return value


def read_header(
    text: bytes, line: int, layout: CsvFormat, counts: RowCounts, origin: str
) -> tuple[tuple[str, ...], bytes, int]:
    """Column names, the text after the header, and the number of its first line.

    Comment and blank lines before the header are passed over and counted. The text is empty where the header
    has not come yet.
    """
    comment = layout.comment.encode(layout.encoding)
    while text:
        head, _, rest = text.partition(b"\n")
        stripped = head.strip()
        if line <= layout.skip_lines:
            counts.header += 1
        elif not stripped:
            counts.blanks += 1
        elif comment and stripped.startswith(comment):
            counts.comments += 1
        elif not layout.has_header:
            return layout.names, text, line
        else:
            counts.header += 1
            return _names(head, layout, f"{origin}:{line}"), rest, line + 1
        text, line = rest, line + 1
    return (), b"", line


def _names(head: bytes, layout: CsvFormat, where: str) -> tuple[str, ...]:
    try:
        cells = next(csv.reader([head.decode(layout.encoding)], delimiter=_separator(layout)))
    except (UnicodeDecodeError, LookupError, csv.Error, StopIteration) as error:
        raise InputError(f"the line of column names cannot be read: {error}", where=where) from None
    return tuple(cell.strip() for cell in cells)
