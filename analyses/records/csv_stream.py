"""CSV records of any length, block by block: bounded memory, and an account of every row."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from actuator_lti.bounds import CSV_LINE_BYTES, CSV_ROWS
from actuator_lti.errors import InputError
from actuator_lti.files.reading import open_regular
from analyses.estimation.arrays import FloatArray
from analyses.records.bounded import BoundedRows
from analyses.records.columns import find_columns, read_header
from analyses.records.csv_rows import Account, Block, Columns, careful_rows, clean, fast_rows
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
    """Read a CSV file into a record.

    Parameters
    ----------
    path : str or Path
        The file.
    spec : RecordSpec
        Its layout, its columns and units, what to do with bad rows.
    max_rows : int
        A file with more rows than this is averaged over 2, 4, 8 ... neighbours while it is read, so that
        memory stays bounded whatever its length; ``Record.averaged`` and a note tell.

    Returns
    -------
    Record
        Time in s from the file's own clock, signals in SI.

    Raises
    ------
    InputError
        Names the file, the line, the column and the reason.
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
