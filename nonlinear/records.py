"""Columns of numbers from a CSV file, with refusals that name the place."""

from __future__ import annotations

import csv
from os import PathLike
from pathlib import Path

import numpy as np
import numpy.typing as npt

from actuator_lti.errors import InputError

Floats = npt.NDArray[np.float64]


def read_columns(
    path: str | PathLike[str], columns: tuple[str | int, ...], delimiter: str = ","
) -> list[Floats]:
    """Read columns, by header name or number, of a CSV file whose first line is a header.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing, or a cell is not a number.
    """
    where = str(path)
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot be read ({error})", where) from error
    rows = [row for row in csv.reader(text.splitlines(), delimiter=delimiter) if row]
    if len(rows) < 2:
        raise InputError("a header line and at least one row of numbers needed", where)
    header = [name.strip() for name in rows[0]]
    return [_column(rows, _place(column, header, where), where) for column in columns]


def _place(column: str | int, header: list[str], where: str) -> int:
    if isinstance(column, str):
        if column not in header:
            raise InputError(f"no column {column!r}; there are {', '.join(header)}", where)
        return header.index(column)
    if not 0 <= column < len(header):
        raise InputError(f"column {column}: must be 0 to {len(header) - 1}", where)
    return column


def _column(rows: list[list[str]], place: int, where: str) -> Floats:
    out = np.empty(len(rows) - 1)
    for k, row in enumerate(rows[1:]):
        try:
            out[k] = float(row[place])
        except (ValueError, IndexError) as error:
            cell = row[place] if place < len(row) else ""
            raise InputError(
                f"line {k + 2}, column {place + 1} = {cell!r}: must be a number", where
            ) from error
    return out
