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
    bar = _Bar(description, enabled=not quiet and sys.stderr.isatty())
    try:
        yield bar.report
    finally:
        bar.close()


class _Bar:
    """A rich progress bar that appears only after `PATIENCE_S`."""

    def __init__(self, description: str, *, enabled: bool) -> None:
        self._description = description
        self._enabled = enabled
        self._started_s = time.monotonic()
        self._bar: Progress | None = None

    def report(self, done: int, total: int) -> None:
        if not self._enabled:
            return
        if self._bar is None:
            if time.monotonic() - self._started_s < PATIENCE_S:
                return
            self._bar = _rich_bar()
            self._bar.start()
            self._task = self._bar.add_task(self._description, total=total)
        self._bar.update(self._task, completed=done, total=total)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.stop()


def _rich_bar() -> Progress:
    """Make the bar; rich is imported only when one is needed."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    return Progress(*columns, console=Console(stderr=True), transient=True)
