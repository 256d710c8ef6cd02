"""Somebody who looks at every simulation while it runs, and may stop it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Watch = Callable[[], None]
_watching: ContextVar[Watch | None] = ContextVar("watching", default=None)


@contextmanager
def watched(look: Watch) -> Iterator[None]:
    """Call ``look`` some times a second while anything is simulated inside; what it raises ends the runs."""
    token = _watching.set(look)
    try:
        yield
    finally:
        _watching.reset(token)


def watch() -> Watch | None:
    """Who looks now."""
    return _watching.get()
