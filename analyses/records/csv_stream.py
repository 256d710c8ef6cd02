"""CSV records of any length, block by block: bounded memory, and an account of every row.

A block goes through Arrow's reader where it is clean, else line by line.
"""

from __future__ import annotations

import csv
import hashlib
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO

import numpy as np

from actuator_lti.bounds import CSV_LINE_BYTES, CSV_ROWS
from actuator_lti.errors import InputError
from actuator_lti.files.reading import UTF_16, open_regular
from actuator_lti.start.extras import need
from actuator_lti.types import Floats
from analyses.records.record import Record, RowCounts
from analyses.records.spec import MISSING_TEXTS, CsvFormat, RecordSpec
from analyses.records.table_record import Block, SiRows, record_of_rows

BLOCK_BYTES = 1 << 22
UTF_8 = CsvFormat().encoding
BAD_ROWS = 'allowed: rows of numbers, or bad_rows = "drop" in a record file'
_RUN_OF_BLANKS = re.compile(rb"[ \t]+")
STAMP = re.compile(rb"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d)(?:[.,](\d+))?(Z|[+-]\d\d:?\d\d)?")
"""A time stamp of ISO 8601: to the second, its fraction, its zone."""


def read_csv_record(path: str | Path, spec: RecordSpec, *, max_rows: int = CSV_ROWS.most) -> Record:
    """Read a CSV file into a record: time in s from the file's own clock, signals in SI.

    A file of more than ``max_rows`` is averaged over 2, 4, 8 ... neighbours while it is read, so that memory
    stays bounded whatever its length; ``Record.averaged`` and a note tell. An InputError names the file, the
    line, the column and the reason.
    """
    origin, counts, digest = str(path), RowCounts(), hashlib.sha256()
    rows = BoundedRows(columns=1 + len(spec.signals), limit=max_rows)
    in_si, file = SiRows(spec, counts, origin), _File(spec, counts, origin)
    with open_regular(Path(path), "CSV file") as stream:
        for data in _line_blocks(stream, origin, digest):
            if (block := file.block(data)) is not None:
                rows.add(in_si(block))
    return record_of_rows(rows.array(), spec, Path(path), counts, digest.hexdigest(), rows.factor)


@dataclass
class _File:
    """A file while it is read, with the account of its lines and, once there, its columns."""

    spec: RecordSpec
    counts: RowCounts
    origin: str
    positions: tuple[int, ...] = ()  # of the wanted columns

    def block(self, data: bytes) -> Block | None:
        """The rows of some whole lines; None without any."""
        counts, line = self.counts, self.counts.lines + 1
        counts.lines += data.count(b"\n") + (not data.endswith(b"\n"))
        text = _clean(data, self.spec.format, counts)
        if not counts.columns:
            counts.columns, text, line = self._header(text, line)
            self.positions = self.spec.positions(counts.columns, self.origin) if counts.columns else ()
        if not text:
            return None
        block = self._fast_rows(text, line)
        if block is None:
            return self._careful_rows(text, line)
        counts.rows_in += len(block.lines)
        return block

    def _header(self, text: bytes, line: int) -> tuple[tuple[str, ...], bytes, int]:
        """Column names, the text after the header, and the number of its first line.

        Comment and blank lines before the header are passed over and counted. The text is empty where the
        header has not come yet.
        """
        layout, counts = self.spec.format, self.counts
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
                try:
                    cells = next(csv.reader([text_of(head, layout.encoding)], delimiter=_separator(layout)))
                except (LookupError, csv.Error, StopIteration) as error:
                    why = f"the line of column names cannot be read: {error}"
                    raise InputError(why, where=f"{self.origin}:{line}") from None
                return tuple(cell.strip() for cell in cells), rest, line + 1
            text, line = rest, line + 1
        return (), b"", line

    def _fast_rows(self, data: bytes, first_line: int) -> Block | None:
        """A whole cleaned block through Arrow's reader; None where any line needs a closer look."""
        need("pyarrow", "tables", "a record")
        import pyarrow as pa
        import pyarrow.csv as pc

        layout, positions = self.spec.format, self.positions
        if layout.comment and layout.comment.encode(layout.encoding) in data:
            return None
        lines = data.count(b"\n") + (not data.endswith(b"\n"))
        names = [str(position) for position in range(len(self.counts.columns))]
        wanted = list(dict.fromkeys(names[position] for position in positions))
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
        if table.num_rows != lines:
            return None
        whole = table.combine_chunks().to_batches()[0].to_tensor(null_to_nan=True)  # columns load pandas
        values = whole.to_numpy()[:, [wanted.index(names[position]) for position in positions]]
        if np.isnan(values).all(axis=1).any() or np.isinf(values).any():
            return None
        return Block(values=values, lines=np.arange(first_line, first_line + lines))

    def _careful_rows(self, data: bytes, first_line: int) -> Block:
        """A cleaned block line by line: comments and blanks counted, every faulty row named or dropped."""
        layout, counts, header = self.spec.format, self.counts, self.counts.columns
        text = text_of(data, layout.encoding)
        rows, numbers = [], []
        for number, line in enumerate(text.removesuffix("\n").split("\n"), first_line):
            stripped = line.strip()
            if not stripped:
                counts.blanks += 1
            elif layout.comment and stripped.startswith(layout.comment):
                counts.comments += 1
            else:
                counts.rows_in += 1
                cells = line.split(_separator(layout))
                try:
                    if len(cells) != len(header):
                        raise ValueError(f"{len(cells)} columns where {len(header)} are expected")
                    if tuple(cell.strip().strip('"') for cell in cells) == header:
                        raise ValueError("the line of column names once more")
                    rows.append([_number(cells[k], header[k], layout.decimal) for k in self.positions])
                    numbers.append(number)
                except ValueError as error:
                    if self.spec.bad_rows == "error":
                        raise InputError(f"{error}; {BAD_ROWS}", where=f"{self.origin}:{number}") from None
                    counts.drop("not a row of numbers", f"line {number}, {error}")
        values = np.array(rows, dtype=np.float64).reshape(len(rows), len(self.positions))
        return Block(values=values, lines=np.array(numbers, dtype=np.int64))


def text_of(data: bytes, encoding: str = UTF_8) -> str:
    """Text in its encoding; what is no UTF-8, where that is the default, is Windows-1252.

    >>> text_of("Winkel [°]".encode("cp1252")), text_of("Winkel [°]".encode())
    ('Winkel [°]', 'Winkel [°]')
    """
    try:
        return data.decode(encoding)
    except UnicodeDecodeError:
        return data.decode("cp1252" if encoding == UTF_8 else encoding, errors="replace")


def _line_blocks(stream: BinaryIO, origin: str, digest: hashlib._Hash) -> Iterator[bytes]:
    """Blocks that end at a line end; the last one may lack it."""
    rest, data = b"", stream.read(BLOCK_BYTES)
    digest.update(data)
    if data[:2] in UTF_16:
        raise InputError("is UTF-16; save it as UTF-8", where=origin)
    data = data.removeprefix(b"\xef\xbb\xbf")
    while data:
        if b"\0" in data:
            raise InputError("holds NUL bytes: no text file (UTF-16 is not read; save it as UTF-8)", origin)
        cut = data.rfind(b"\n") + 1
        if not cut and len(rest) + len(data) > CSV_LINE_BYTES.most + BLOCK_BYTES:
            raise InputError(f"a line longer than {CSV_LINE_BYTES.most} bytes: no table of numbers", origin)
        if cut:
            yield rest + data[:cut]
        rest = data[cut:] if cut else rest + data
        data = stream.read(BLOCK_BYTES)
        digest.update(data)
    if rest:
        yield rest


def _clean(data: bytes, layout: CsvFormat, counts: RowCounts) -> bytes:
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


def _number(cell: str, name: str, decimal: str) -> float:
    text = cell.strip().strip('"').strip()
    if text in MISSING_TEXTS:
        return math.nan
    wrong = f'column "{name}" = "{text[:40]}": not '
    try:
        if "_" in text or (decimal == "," and "." in text):
            raise ValueError(text)
        value = float(text.replace(",", ".") if decimal == "," else text)
    except ValueError:
        raise ValueError(f'{wrong}a number (decimal mark "{decimal}")') from None
    if not math.isfinite(value):
        raise ValueError(f"{wrong}finite")
    return value


class BoundedRows:
    """Collects rows; never holds more than ``2 * limit`` of them.

    Once more than ``limit`` rows are held, every two neighbours become their mean and each new row is a mean
    of twice as many rows of the file. ``factor`` tells how many. A remainder shorter than ``factor`` at
    the end of the file becomes a row of its own, so no row is lost.

    >>> rows = BoundedRows(columns=1, limit=4)
    >>> rows.add(np.arange(8.0).reshape(-1, 1))
    >>> rows.array()[:, 0].tolist(), rows.factor
    ([0.5, 2.5, 4.5, 6.5], 2)
    """

    def __init__(self, columns: int, limit: int) -> None:
        self.limit = max(int(limit), 2)
        self.factor = 1
        self._held = [np.empty((0, columns))]
        self._rest = np.empty((0, columns))

    def add(self, rows: Floats) -> None:
        for start in range(0, len(rows), self.limit):
            part = np.concatenate([self._rest, rows[start : start + self.limit]])
            whole = len(part) // self.factor * self.factor
            self._held.append(_averaged(part[:whole], self.factor))
            self._rest = part[whole:]
            while sum(map(len, self._held)) > self.limit:
                held = np.concatenate(self._held)
                even = len(held) // 2 * 2
                self._rest = np.concatenate([np.repeat(held[even:], self.factor, axis=0), self._rest])
                self._held = [_averaged(held[:even], 2)]
                self.factor *= 2

    def array(self) -> Floats:
        last = [self._rest.mean(axis=0, keepdims=True)] if len(self._rest) else []
        return np.concatenate([*self._held, *last])


def _averaged(rows: Floats, factor: int) -> Floats:
    return np.asarray(rows.reshape(-1, factor, rows.shape[1]).mean(axis=1)) if factor > 1 else rows
