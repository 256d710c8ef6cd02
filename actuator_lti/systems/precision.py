"""The working precision of exact arithmetic: one number for all threads of a process, so they take turns."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock

from flint import ctx

_TURN = RLock()
USUAL = 53  # bits


@contextmanager
def precision(bits: int = USUAL) -> Iterator[None]:
    """Within a block, or a function, results have so many bits; no other thread computes with its own."""
    with _TURN, ctx.workprec(bits):
        yield
