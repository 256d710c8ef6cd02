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
from analyses.records.csv_rows import (
    Account,
    Block,
    Columns,
    careful_rows,
    clean,
    fast_rows,
    find_columns,
    read_header,
)
from analyses.records.record import Record
from analyses.records.spec import RecordSpec
from analyses.records.table_record import in_si, record_of_rows

BLOCK_BYTES = 1 << 22
MAX_LINE_BYTES = CSV_LINE_BYTES.most
MAX_ROWS = CSV_ROWS.most


def read_csv_record(
    path: str | Path,
    spec: RecordSpec,
    *,
    max_rows: int = MAX_ROWS,
) -> Record:
    """Read a CSV file into a record: time in s from the file's own clock, signals in SI.

    A file of more than ``max_rows`` is averaged over 2, 4, 8 ... neighbours while it is read, so that memory
    stays bounded whatever its length; ``Record.averaged`` and a note tell. An InputError names the file, the
    line, the column and the reason.
    """
    path = Path(path)
    account, digest = Account(), hashlib.sha256()
    rows = BoundedRows(columns=1 + len(spec.signals), limit=max_rows)
    for chunk in stream_csv(path, spec, account=account, digest=digest):
        rows.add(chunk)
    return record_of_rows(rows.array(), spec, path, account, digest.hexdigest(), rows.factor)


def stream_csv(
    path: str | Path,
    spec: RecordSpec,
    *,
    account: Account | None = None,
    digest: hashlib._Hash | None = None,
) -> Iterator[FloatArray]:
    """Yield blocks of rows, shape (n, 1 + signals): time in s, then each signal in SI.

    Memory does not depend on the length of the file. ``account`` is filled in on the way.
    """
    path = Path(path)
    account = Account() if account is None else account
    convert = in_si(spec, account, str(path))
    for block in _blocks(path, spec, account, digest):
        rows = convert(block)
        if len(rows):
            yield rows


def _blocks(path: Path, spec: RecordSpec, account: Account, digest: hashlib._Hash | None) -> Iterator[Block]:
    layout = spec.format
    with open_regular(path, "CSV file") as stream:
        columns: Columns | None = None
        for data in _line_blocks(stream, str(path)):
            if digest is not None:
                digest.update(data)
            line = account.lines + 1
            account.lines += data.count(b"\n") + (not data.endswith(b"\n"))
            text = clean(data, layout, account)
            if columns is None:
                header, text, line = read_header(text, line, layout, account, str(path))
                if header is None and not text:
                    continue
                columns = find_columns(header, text, spec, str(path))
                account.columns = header or tuple(str(k + 1) for k in range(columns.count))
            if text:
                yield _rows(text, line, columns, spec, account, str(path))


def _rows(text: bytes, line: int, columns: Columns, spec: RecordSpec, account: Account, origin: str) -> Block:
    block = fast_rows(text, line, columns, spec.format)
    if block is None:
        return careful_rows(text, line, columns, spec.format, spec.bad_rows, account, origin)
    account.rows_in += len(block.lines)
    return block


def _line_blocks(stream: BinaryIO, origin: str) -> Iterator[bytes]:
    """Blocks that end at a line end; the last one may lack it."""
    rest, first = b"", True
    while True:
        data = stream.read(BLOCK_BYTES)
        if not data:
            break
        if first:
            data, first = _without_bom(data, origin), False
        if b"\0" in data:
            raise InputError(
                "holds NUL bytes: not a text file (UTF-16 is not read; save it as UTF-8)", where=origin
            )
        cut = data.rfind(b"\n") + 1
        if not cut and len(rest) + len(data) > MAX_LINE_BYTES + BLOCK_BYTES:
            raise InputError(
                f"a line longer than {MAX_LINE_BYTES} bytes: not a table of numbers", where=origin
            )
        if cut:
            yield rest + data[:cut]
            rest = data[cut:]
        else:
            rest += data
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
        self._columns = columns
        self._blocks: list[FloatArray] = []
        self._held = 0
        self._rest = np.empty((0, columns))

    def add(self, rows: FloatArray) -> None:
        """Append rows, shape (n, columns)."""
        for start in range(0, len(rows), self.limit):
            self._add(rows[start : start + self.limit])

    def _add(self, rows: FloatArray) -> None:
        if len(self._rest):
            rows = np.concatenate([self._rest, rows])
        whole = len(rows) // self.factor * self.factor
        self._rest = rows[whole:].copy()
        if whole:
            self._blocks.append(_averaged(rows[:whole], self.factor))
            self._held += whole // self.factor
        while self._held > self.limit:
            self._halve()

    def _halve(self) -> None:
        held = np.concatenate(self._blocks)
        even = len(held) // 2 * 2
        odd = np.repeat(held[even:], self.factor, axis=0)
        self._rest = np.concatenate([odd, self._rest])
        self._blocks = [_averaged(held[:even], 2)]
        self._held = even // 2
        self.factor *= 2

    def array(self) -> FloatArray:
        """All rows, shape (m, columns)."""
        blocks = list(self._blocks)
        if len(self._rest):
            blocks.append(self._rest.mean(axis=0, keepdims=True))
        return np.concatenate(blocks) if blocks else np.empty((0, self._columns))


def _averaged(rows: FloatArray, factor: int) -> FloatArray:
    if factor == 1:
        return rows
    mean: FloatArray = rows.reshape(-1, factor, rows.shape[1]).mean(axis=1)
    return mean
