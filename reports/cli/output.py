"""What commands print: JSON for machines, tables for people, both on standard output."""

from __future__ import annotations

import os
import sys
import unicodedata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

_OBEYED = ("Cc", "Cs")


def print_json(data: Any) -> None:
    """Print a JSON value, numpy included; NaN and infinity become null."""
    import json

    from reports.document import plain

    text = json.dumps(plain(data), ensure_ascii=False, allow_nan=False, indent=2)
    # what is no Unicode (a path of other bytes) stays an escape of JSON
    sys.stdout.write(text.encode("utf-8", "backslashreplace").decode() + "\n")


def console() -> Console:
    """Give the console for people: colours on a terminal, plain text in a pipe (120 wide, or COLUMNS)."""
    from rich.console import Console

    width = None if sys.stdout.isatty() or "COLUMNS" in os.environ else 120
    return Console(highlight=False, width=width)


def print_warning(text: str) -> None:
    """Print one line about something suspicious on standard error."""
    sys.stderr.write(f"warning: {printable(' '.join(text.split()))}\n")


def print_line(text: str) -> None:
    """Print plain text; what a terminal would obey instead of showing it becomes a question mark."""
    sys.stdout.write(printable(text) + "\n")


def printable(text: str) -> str:
    """The text without control characters but line breaks and tabs.

    Examples
    --------
    >>> printable("a\\x1b[31mb")
    'a?[31mb'
    """
    if text.isprintable():
        return text
    return "".join("?" if unicodedata.category(c) in _OBEYED and c not in "\n\t" else c for c in text)
