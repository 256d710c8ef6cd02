"""Progress on standard error, for whatever takes longer than a moment."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress

Report = Callable[[int, int], None]
PATIENCE_S = 0.7


@contextmanager
def progress(description: str, *, quiet: bool = False) -> Iterator[Report]:
    """Give a function ``(done, total)`` that shows a bar on the terminal once the work takes a while.

    Nothing is shown where standard error is no terminal, so that logs stay clean.

    Examples
    --------
    >>> with progress("counting") as report:
    ...     report(1, 1)
    """
    shown, started_s = not quiet and sys.stderr.isatty(), time.monotonic()
    bars: list[Progress] = []

    def report(done: int, total: int) -> None:
        if not shown or (not bars and time.monotonic() - started_s < PATIENCE_S):
            return
        if not bars:
            bars.append(_rich_bar())
            bars[0].start()
            bars[0].add_task(description)
        bars[0].update(bars[0].task_ids[0], completed=done, total=total)

    try:
        yield report
    finally:
        for bar in bars:
            bar.stop()


def _rich_bar() -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    return Progress(*columns, console=Console(stderr=True), transient=True)
