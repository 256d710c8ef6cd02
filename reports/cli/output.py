"""What commands print: JSON for machines, tables for people, both on standard output."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console


def print_json(data: Any) -> None:
    """Print a JSON value, numpy included; NaN and infinity become null."""
    import json

    from reports.document import plain

    sys.stdout.write(json.dumps(plain(data), ensure_ascii=False, allow_nan=False, indent=2) + "\n")


def console() -> Console:
    """Give the console for people: colours on a terminal, plain text in a pipe (120 wide, or COLUMNS)."""
    from rich.console import Console

    width = None if sys.stdout.isatty() or "COLUMNS" in os.environ else 120
    return Console(highlight=False, width=width)


def print_warning(text: str) -> None:
    """Print one line about something suspicious on standard error."""
    sys.stderr.write(f"warning: {' '.join(text.split())}\n")


def print_line(text: str) -> None:
    """Print one line of plain text."""
    sys.stdout.write(text + "\n")
