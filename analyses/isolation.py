"""Parts of a report that fail alone and are noted, where missing parts are shown (`isolated`)."""

import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TypeVar

from actuator_lti.errors import InputError, NumericalError, OutOfTime

T = TypeVar("T")
U = TypeVar("U")
EXPECTED = NumericalError | OutOfTime


@dataclass(frozen=True)
class Missing:
    """A part that could not be computed."""

    part: str  # in words
    why: str  # one line
    traceback: str  # where it happened; empty for a numerical failure, which was expected


_noted: ContextVar[list[Missing] | None] = ContextVar("noted", default=None)
_shown: list[Missing] = []


@contextmanager
def isolated() -> Iterator[list[Missing]]:
    """Collect what fails inside; an outer collection gets it, too, and in the end `drain`.

    >>> with isolated() as missing:
    ...     attempt("a ratio", lambda: 1 / 0, None)
    >>> missing[0].part, missing[0].why
    ('a ratio', 'unexpected ZeroDivisionError: division by zero')
    """
    outer, own = _noted.get(), list[Missing]()
    token = _noted.set(own)
    try:
        yield own
    finally:
        _noted.reset(token)
        (_shown if outer is None else outer).extend(own)


def drain() -> list[Missing]:
    """All that was noted in this process since the last call: what decides the exit status."""
    noted = _shown[:]
    _shown.clear()
    return noted


def note(missing: Iterable[Missing]) -> None:
    """Add what failed elsewhere, in another process say, to the collection."""
    noted = _noted.get()
    (_shown if noted is None else noted).extend(missing)


def attempt(part: str, work: Callable[[], T], otherwise: U) -> T | U:
    """Do some work; `isolated` notes a failure and goes on with ``otherwise``, but for an `InputError`."""
    if _noted.get() is None:
        return work()
    result, missing = caught(part, work)
    if missing is None:
        return result  # type: ignore[return-value]
    note([missing])
    return otherwise


def caught(part: str, work: Callable[[], T]) -> tuple[T | None, Missing | None]:
    """Do some work and give its result, or what failed; for work in other processes."""
    try:
        return work(), None
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001 - the one place that promises to show what is missing
        return None, Missing(part, reason(error), traceback_of(error))


def reason(error: BaseException) -> str:
    """What went wrong in one line."""
    words = "".join(c if c.isprintable() else "?" for c in " ".join(str(error).split())[:400])
    if isinstance(error, OutOfTime):
        return words
    kind = "numerical failure" if isinstance(error, EXPECTED) else f"unexpected {type(error).__name__}"
    return f"{kind}: {words}" if words or isinstance(error, EXPECTED) else kind


def traceback_of(error: BaseException) -> str:
    """Where it happened; empty for what was expected."""
    return "" if isinstance(error, EXPECTED) else "".join(traceback.format_exception(error))
