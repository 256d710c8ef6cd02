"""CSV records of any length, block by block: bounded memory, and an account of every row."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from actuator_lti.bounds import CSV_LINE_BYTES, CSV_ROWS
from actuator_lti.errors import InputError
from actuator_lti.files.reading import open_regular
from analyses.estimation.arrays import FloatArray
from analyses.records.csv_rows import Block, Columns, careful_rows, clean, fast_rows, read_header
from analyses.records.record import Record, RowCounts
from analyses.records.spec import RecordSpec
from analyses.records.table_record import SiRows, record_of_rows

BLOCK_BYTES = 1 << 22
MAX_LINE_BYTES = CSV_LINE_BYTES.most
MAX_ROWS = CSV_ROWS.most


def read_csv_record(path: str | Path, spec: RecordSpec, *, max_rows: int = MAX_ROWS) -> Record:
    """Read a CSV file into a record: time in s from the file's own clock, signals in SI.

    A file of more than ``max_rows`` is averaged over 2, 4, 8 ... neighbours while it is read, so that memory
    stays bounded whatever its length; ``Record.averaged`` and a note tell. An InputError names the file, the
    line, the column and the reason.
    """
    counts, digest = RowCounts(), hashlib.sha256()
    rows = BoundedRows(columns=1 + len(spec.signals), limit=max_rows)
    for chunk in stream_csv(path, spec, counts=counts, digest=digest):
        rows.add(chunk)
    return record_of_rows(rows.array(), spec, Path(path), counts, digest.hexdigest(), rows.factor)


def stream_csv(
    path: str | Path,
    spec: RecordSpec,
    *,
    counts: RowCounts | None = None,
    digest: hashlib._Hash | None = None,
) -> Iterator[FloatArray]:
    """Yield blocks of rows, shape (n, 1 + signals): time in s, then each signal in SI.

    Memory does not depend on the length of the file. ``counts`` is filled in on the way.
    """
    counts = RowCounts() if counts is None else counts
    in_si = SiRows(spec, counts, str(path))
    for block in _blocks(Path(path), spec, counts, digest or hashlib.sha256()):
        rows = in_si(block)
        if len(rows):
            yield rows


def _blocks(path: Path, spec: RecordSpec, counts: RowCounts, digest: hashlib._Hash) -> Iterator[Block]:
    layout, origin = spec.format, str(path)
    columns: Columns | None = None
    with open_regular(path, "CSV file") as stream:
        for data in _line_blocks(stream, origin):
            digest.update(data)
            line = counts.lines + 1
            counts.lines += data.count(b"\n") + (not data.endswith(b"\n"))
            text = clean(data, layout, counts)
            if columns is None:
                header, text, line = read_header(text, line, layout, counts, origin)
                if not header:
                    continue
                columns = Columns(header=header, positions=spec.positions(header, origin))
                counts.columns = header
            if not text:
                continue
            block = fast_rows(text, line, columns, layout)
            if block is None:
                block = careful_rows(text, line, columns, spec, counts, origin)
            else:
                counts.rows_in += len(block.lines)
            yield block


def _line_blocks(stream: BinaryIO, origin: str) -> Iterator[bytes]:
    """Blocks that end at a line end; the last one may lack it."""
    rest = b""
    data = _without_bom(stream.read(BLOCK_BYTES), origin)
    while data:
        if b"\0" in data:
            told = "holds NUL bytes: not a text file (UTF-16 is not read; save it as UTF-8)"
            raise InputError(told, where=origin)
        cut = data.rfind(b"\n") + 1
        if not cut and len(rest) + len(data) > MAX_LINE_BYTES + BLOCK_BYTES:
            told = f"a line longer than {MAX_LINE_BYTES} bytes: not a table of numbers"
            raise InputError(told, where=origin)
        if cut:
            yield rest + data[:cut]
        rest = data[cut:] if cut else rest + data
        data = stream.read(BLOCK_BYTES)
    if rest:
        yield rest


def _without_bom(data: bytes, origin: str) -> bytes:
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise InputError("is UTF-16; save it as UTF-8", where=origin)
    return data.removeprefix(b"\xef\xbb\xbf")


class BoundedRows:
    """Collects rows; never holds more than ``2 * limit`` of them.

    Once more than ``limit`` rows are held, every two neighbours become their mean and each new row is a mean
    of twice as many rows of the file. ``factor`` tells how many. A remainder shorter than ``factor`` at
    the end of the file becomes a row of its own, so no row is lost.

    Examples
    --------
    >>> import numpy as np
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

    def add(self, rows: FloatArray) -> None:
        """Append rows, shape (n, columns)."""
        for start in range(0, len(rows), self.limit):
            part = np.concatenate([self._rest, rows[start : start + self.limit]])
            whole = len(part) // self.factor * self.factor
            self._held.append(_averaged(part[:whole], self.factor))
            self._rest = part[whole:]
            while sum(map(len, self._held)) > self.limit:
                self._halve()

    def _halve(self) -> None:
        held = np.concatenate(self._held)
        even = len(held) // 2 * 2
        self._rest = np.concatenate([np.repeat(held[even:], self.factor, axis=0), self._rest])
        self._held = [_averaged(held[:even], 2)]
        self.factor *= 2

    def array(self) -> FloatArray:
        """All rows, shape (m, columns)."""
        last = [self._rest.mean(axis=0, keepdims=True)] if len(self._rest) else []
        return np.concatenate([*self._held, *last])


def _averaged(rows: FloatArray, factor: int) -> FloatArray:
    return np.asarray(rows.reshape(-1, factor, rows.shape[1]).mean(axis=1)) if factor > 1 else rows
