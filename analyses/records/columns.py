"""The head of a CSV file: skipped lines, comments, the line of column names, and the columns wanted."""

from __future__ import annotations

import csv
from difflib import get_close_matches

from actuator_lti.errors import InputError
from analyses.records.csv_rows import Account, Columns, separator_of
from analyses.records.spec import CsvFormat, RecordSpec


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
