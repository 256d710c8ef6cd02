"""The head of a CSV file, and its text into rows of numbers: fast where clean, else line by line."""

from __future__ import annotations

import csv
import math
import re
from copy import deepcopy
from dataclasses import dataclass, field, fields
from datetime import UTC, datetime
from difflib import get_close_matches

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.start.extras import need
from analyses.estimation.arrays import FloatArray, IntArray
from analyses.records.record import RowCounts
from analyses.records.spec import MISSING_TEXTS, CsvFormat, Policy, RecordSpec

_RUN_OF_BLANKS = re.compile(rb"[ \t]+")
STAMP = re.compile(rb"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d)(?:[.,](\d+))?(Z|[+-]\d\d:?\d\d)?")
"""A time stamp of ISO 8601: to the second, its fraction, its zone."""


@dataclass
class Account:
    """The running count of lines and rows while a file is read."""

    lines: int = 0
    comments: int = 0
    blanks: int = 0
    header: int = 0
    rows_in: int = 0
    rows_out: int = 0
    dropped: dict[str, int] = field(default_factory=dict)
    first_dropped: dict[str, str] = field(default_factory=dict)
    columns: tuple[str, ...] = ()
    first_stamp: datetime | None = None

    def drop(self, reason: str, where: str, count: int = 1) -> None:
        """Count rows that are left out, and where the first of them was."""
        if count:
            self.dropped[reason] = self.dropped.get(reason, 0) + count
            self.first_dropped.setdefault(reason, where)

    def frozen(self) -> RowCounts:
        """The final figures."""
        return RowCounts(**deepcopy({one.name: getattr(self, one.name) for one in fields(RowCounts)}))


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Which columns of a row are wanted: their positions (from 0) and their names, and how many there are."""

    positions: tuple[int, ...]
    names: tuple[str, ...]
    count: int


@dataclass(frozen=True, kw_only=True)
class Block:
    """Numbers of the wanted columns, shape (n, columns), NaN where missing, and the file line of each row."""

    values: FloatArray
    lines: IntArray


def clean(data: bytes, layout: CsvFormat, account: Account) -> bytes:
    """Line ends to newline, row ends cut off, runs of blanks to one tab, time stamps to seconds."""
    if layout.stamps:
        data = STAMP.sub(lambda stamp: _seconds(stamp, layout, account), data)
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n")
    if layout.separator == "whitespace":
        data = _RUN_OF_BLANKS.sub(b"\t", data).replace(b"\n\t", b"\n").replace(b"\t\n", b"\n").lstrip(b"\t")
    if layout.row_end:
        end = layout.row_end.encode(layout.encoding)
        data = data.replace(end + b"\n", b"\n").removesuffix(end)
    return data


def _seconds(stamp: re.Match[bytes], layout: CsvFormat, account: Account) -> bytes:
    """Seconds from the first stamp's whole second, all digits of the fraction kept; UTC without a zone."""
    try:
        read = datetime.fromisoformat((stamp[1] + (stamp[3] or b"")).decode())
    except ValueError:
        return stamp[0]
    read = read if read.tzinfo else read.replace(tzinfo=UTC)
    account.first_stamp = account.first_stamp or read
    whole = (read - account.first_stamp).total_seconds()
    return f"{whole:.0f}{layout.decimal}{(stamp[2] or b'0').decode()}".encode()


def separator_of(layout: CsvFormat) -> str:
    """The separator that stands in a cleaned block."""
    return "\t" if layout.separator == "whitespace" else layout.separator


def fast_rows(data: bytes, first_line: int, columns: Columns, layout: CsvFormat) -> Block | None:
    """A whole cleaned block through Arrow's reader; None where any line needs a closer look."""
    need("pyarrow", "tables", "a record")
    import pyarrow as pa
    import pyarrow.csv as pc

    if not data or (layout.comment and layout.comment.encode(layout.encoding) in data):
        return None
    lines = data.count(b"\n") + (not data.endswith(b"\n"))
    names = [str(position) for position in range(columns.count)]
    wanted = list(dict.fromkeys(names[position] for position in columns.positions))
    try:
        table = pc.read_csv(
            pa.BufferReader(data),
            read_options=pc.ReadOptions(column_names=names, use_threads=False, block_size=len(data) + 1),
            parse_options=pc.ParseOptions(
                delimiter=separator_of(layout), quote_char=False, ignore_empty_lines=False
            ),
            convert_options=pc.ConvertOptions(
                column_types=dict.fromkeys(wanted, pa.float64()),
                include_columns=wanted,
                null_values=list(MISSING_TEXTS),
                decimal_point=layout.decimal,
            ),
        )
    except (pa.ArrowException, UnicodeDecodeError):
        return None
    if table.num_rows != lines:
        return None
    picked = [table.column(names[position]).to_numpy() for position in columns.positions]
    values = np.column_stack(picked) if picked else np.empty((lines, 0))
    if np.isinf(values).any() or (len(values) and np.isnan(values).all(axis=1).any()):
        return None
    return Block(values=values, lines=np.arange(first_line, first_line + lines))


def careful_rows(
    data: bytes,
    first_line: int,
    columns: Columns,
    layout: CsvFormat,
    policy: Policy,
    account: Account,
    origin: str,
) -> Block:
    """A cleaned block line by line: comments and blanks counted, every faulty row named or dropped."""
    text = data.decode(layout.encoding, errors="replace")
    body = text[:-1] if text.endswith("\n") else text
    rows, numbers = [], []
    for number, line in enumerate(body.split("\n"), first_line):
        stripped = line.strip()
        if not stripped:
            account.blanks += 1
        elif layout.comment and stripped.startswith(layout.comment):
            account.comments += 1
        else:
            account.rows_in += 1
            try:
                rows.append(_row(line, columns, layout))
                numbers.append(number)
            except ValueError as error:
                if policy == "error":
                    raise InputError(str(error), where=f"{origin}:{number}") from None
                account.drop("not a row of numbers", f"line {number}, {error}")
    values = np.array(rows, dtype=np.float64).reshape(len(rows), len(columns.positions))
    return Block(values=values, lines=np.array(numbers, dtype=np.int64))


def _row(line: str, columns: Columns, layout: CsvFormat) -> list[float]:
    cells = line.split(separator_of(layout))
    if len(cells) != columns.count:
        raise ValueError(f"{len(cells)} columns where {columns.count} are expected")
    out = []
    for position, name in zip(columns.positions, columns.names, strict=True):
        if position >= len(cells):
            raise ValueError(f'column "{name}": the row has only {len(cells)} columns')
        out.append(_number(cells[position], name, layout.decimal))
    return out


def _number(cell: str, name: str, decimal: str) -> float:
    text = cell.strip().strip('"').strip()
    if text in MISSING_TEXTS:
        return math.nan
    plain = text.replace(",", ".") if decimal == "," else text
    try:
        if "_" in plain or (decimal == "," and "." in text):
            raise ValueError(text)
        value = float(plain)
    except ValueError:
        raise ValueError(
            f'column "{name}" = "{text[:40]}": not a number (decimal mark "{decimal}")'
        ) from None
    if not math.isfinite(value):
        raise ValueError(f'column "{name}" = "{text[:40]}": not finite')
    return value


def read_header(
    text: bytes, line: int, layout: CsvFormat, account: Account, origin: str
) -> tuple[tuple[str, ...] | None, bytes, int]:
    """Column names, the text after the header, and the number of its first line.

    Comment and blank lines before the header are passed over and counted. The names are None where the
    header has not come yet (then the text is empty).
    """
    comment = layout.comment.encode(layout.encoding)
    while text:
        head, _, rest = text.partition(b"\n")
        stripped = head.strip()
        if line <= layout.skip_lines:
            account.header += 1
        elif not stripped:
            account.blanks += 1
        elif comment and stripped.startswith(comment):
            account.comments += 1
        elif not layout.has_header:
            return layout.names or None, text, line
        else:
            account.header += 1
            return _names(head, layout, f"{origin}:{line}"), rest, line + 1
        text, line = rest, line + 1
    return None, b"", line


def _names(head: bytes, layout: CsvFormat, where: str) -> tuple[str, ...]:
    try:
        decoded = head.decode(layout.encoding)
        cells = next(csv.reader([decoded], delimiter=separator_of(layout)))
    except (UnicodeDecodeError, LookupError, csv.Error, StopIteration) as error:
        raise InputError(f"the line of column names cannot be read: {error}", where=where) from None
    return tuple(cell.strip() for cell in cells)


def find_columns(header: tuple[str, ...] | None, text: bytes, spec: RecordSpec, origin: str) -> Columns:
    """Positions of the wanted columns: the time first (where there is a time column), then the signals.

    Without column names the first row of ``text`` tells how many columns there are.
    """
    positions = tuple(_position(column, header, origin) for column in spec.columns(header or ()))
    names = tuple(header[p] if header and p < len(header) else str(p + 1) for p in positions)
    separator = separator_of(spec.format).encode(spec.format.encoding)
    count = len(header) if header else text.partition(b"\n")[0].count(separator) + 1
    return Columns(positions=positions, names=names, count=count)


def _position(column: str | int, header: tuple[str, ...] | None, origin: str) -> int:
    if isinstance(column, int):
        last = len(header) if header else 10_000
        if not 1 <= column <= last:
            raise InputError(f"column {column}: the columns are numbered 1 to {last}", where=origin)
        return column - 1
    if header is None:
        raise InputError(f'column "{column}": the file has no column names; give its number', where=origin)
    if column not in header:
        near = get_close_matches(column, header, 1)
        hint = f'; did you mean "{near[0]}"?' if near else ""
        there = ", ".join(f'"{name}"' for name in header[:12])
        raise InputError(f'no column "{column}"{hint} There are: {there}', where=origin)
    if header.count(column) > 1:
        raise InputError(
            f'column "{column}" is there {header.count(column)} times; give its number', where=origin
        )
    return header.index(column)
