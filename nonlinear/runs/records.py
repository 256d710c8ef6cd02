"""Columns of numbers from a CSV file, with refusals that name the place."""

import csv
from os import PathLike

import numpy as np

from actuator_lti.bounds import TABLE_BYTES, TABLE_ROWS
from actuator_lti.errors import InputError
from actuator_lti.files.reading import decode, read_bytes, shown, shown_path
from actuator_lti.types import Floats


def read_columns(
    path: str | PathLike[str], columns: tuple[str | int, ...], delimiter: str = ","
) -> list[Floats]:
    """Read columns, by header name or number, of a CSV file whose first line is a header.

    Raises `InputError`: if the file cannot be read, a column is missing, or a cell is not a number.
    """
    where = shown_path(path)
    text = decode(read_bytes(path, "CSV file", TABLE_BYTES), where)
    TABLE_ROWS.check(text.count("\n"), where)
    try:
        rows = [row for row in csv.reader(text.splitlines(), delimiter=delimiter) if row]
    except (csv.Error, TypeError) as error:  # or a delimiter of several characters
        raise InputError(f"no table: {error}", where) from error
    if len(rows) < 2:
        raise InputError("a header line and at least one row of numbers needed", where)
    header = [name.strip() for name in rows[0]]
    return [_column(rows, _place(column, header, where), where) for column in columns]


def _place(column: str | int, header: list[str], where: str) -> int:
    if isinstance(column, str):
        if column not in header:
            there = ", ".join(shown(name) for name in header[:20])
            raise InputError(f"no column {shown(column)}; there are {there}", where)
        return header.index(column)
    if not 0 <= column < len(header):
        raise InputError(f"column {column}: must be 0 to {len(header) - 1}", where)
    return column


def _hint(cell: str) -> str:
    """What a cell that is no number most likely is."""
    if ";" in cell or "\t" in cell:
        return "; separate the columns with commas, and write numbers with a decimal point"
    return (
        "; this looks like TOML, a CSV file is wanted" if "=" in cell or cell.startswith(("#", "[")) else ""
    )


def _column(rows: list[list[str]], place: int, where: str) -> Floats:
    out = np.empty(len(rows) - 1)
    for k, row in enumerate(rows[1:]):
        try:
            out[k] = float(row[place])
        except (ValueError, IndexError) as error:
            cell = row[place] if place < len(row) else ""
            raise InputError(
                f"line {k + 2}, column {place + 1} = {shown(cell)}: must be a number{_hint(cell)}", where
            ) from error
    return out
