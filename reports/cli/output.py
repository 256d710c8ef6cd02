"""What commands print: JSON for machines or tables for people; progress on standard error."""

from __future__ import annotations

import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any, TextIO, cast

from reports.visible import DIRECTION

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as Bar


_TURNED = re.compile(f"[{DIRECTION}]")
_OBEYED = re.compile(f"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff{DIRECTION}]")


def print_json(data: Any) -> None:
    """Print a JSON value, numpy included; NaN and infinity become null."""
    import json

    from reports.document import plain

    text = json.dumps(plain(data), ensure_ascii=False, allow_nan=False, indent=2)
    # what a terminal would obey, or is no Unicode (a path of other bytes), stays escaped
    sys.stdout.write(_OBEYED.sub(lambda found: f"\\u{ord(found[0]):04x}", text) + "\n")


def console() -> Console:
    """Give the console for people: colours on a terminal, plain text in a pipe (120 wide, or COLUMNS)."""
    from rich.console import Console

    class Own(Console):
        def on_broken_pipe(self) -> None:  # rich would leave with 1: a requirement that is not met
            raise BrokenPipeError

    width = None if sys.stdout.isatty() or "COLUMNS" in os.environ else 120
    return Own(highlight=False, width=width, file=cast("TextIO", _Straight()))


class _Straight:
    """Standard output without marks of direction; the other control characters rich takes out itself."""

    def write(self, text: str) -> int:
        sys.stdout.write(_TURNED.sub("?", text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(sys.stdout, name)


def print_warning(text: str) -> None:
    print_note(f"warning: {text}")


def print_note(text: str) -> None:
    sys.stderr.write(f"{printable(' '.join(text.split()))}\n")


def print_line(text: str) -> None:
    """Print plain text; what a terminal would obey instead of showing it becomes a question mark."""
    sys.stdout.write(printable(text) + "\n")


def printable(text: str) -> str:
    """The text without control characters but line breaks and tabs, and without marks of direction.

    >>> printable("a\\x1b[31mb\\u202e")
    'a?[31mb?'
    """
    return text if text.isprintable() else _OBEYED.sub("?", text)


PATIENCE_S = 0.7


@contextmanager
def progress(description: str, *, quiet: bool = False) -> Iterator[Callable[[int, int], None]]:
    """Give a function ``(done, total)`` that shows a bar on the terminal once the work takes a while.

    Nothing is shown where standard error is no terminal, so that logs stay clean.

    >>> with progress("counting") as report:
    ...     report(1, 1)
    """
    shown, started_s = not quiet and sys.stderr.isatty(), time.monotonic()
    bars: list[Bar] = []

    def report(done: int, total: int) -> None:
        if not shown or (not bars and time.monotonic() - started_s < PATIENCE_S):
            return
        if not bars:
            from rich.console import Console
            from rich.progress import Progress

            bars.append(Progress(console=Console(stderr=True), transient=True))
            bars[0].start()
            bars[0].add_task(description)
        bars[0].update(bars[0].task_ids[0], completed=done, total=total)

    try:
        yield report
    finally:
        for bar in bars:
            bar.stop()


@cache
def _tell(text: str) -> None:
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()


@contextmanager
def note_if_slow(text: str, patience_s: float = 1.0) -> Iterator[None]:
    """Write a line to a terminal's standard error if the block is still at work after a while; once each."""
    timer = threading.Timer(patience_s, _tell, (text,))
    timer.daemon = True
    if sys.stderr.isatty():
        timer.start()
    try:
        yield
    finally:
        timer.cancel()
