"""A line on a terminal that says what is being waited for."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

PATIENCE_S = 1.0
_told: set[str] = set()


@contextmanager
def told_if_slow(text: str, patience_s: float = PATIENCE_S) -> Iterator[None]:
    """Write a line to standard error if the block is still at work after a while; once in a process.

    Nothing is written where standard error is no terminal, so that logs stay clean.
    """

    def tell() -> None:
        if text not in _told:
            _told.add(text)
            sys.stderr.write(f"{text}\n")
            sys.stderr.flush()

    timer = threading.Timer(patience_s, tell)
    timer.daemon = True
    if text not in _told and sys.stderr.isatty():
        timer.start()
    try:
        yield
    finally:
        timer.cancel()
