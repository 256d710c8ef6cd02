"""What stands for a value that could not be read, so that what does not need it is checked all the same.

Sums and products with it are unread too; who decides by it, shows it or asks for its parts, stops. It is not
None: its key is written.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, TypeVar

T = TypeVar("T")


class UnreadError(Exception):
    """Something was to be decided by a value that could not be read."""


class _Unread:
    """A number, word, list or table of which nothing is known but that it is there."""

    def _passed_on(self, *_: object) -> _Unread:
        return self

    def _asked(self, *_: object) -> Any:
        raise UnreadError

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _passed_on
    __mod__ = __rmod__ = __pow__ = __rpow__ = __neg__ = __abs__ = _passed_on
    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = __bool__ = __hash__ = __format__ = _asked
    __float__ = __int__ = __index__ = __len__ = __iter__ = __getitem__ = __contains__ = _asked

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name) if name.startswith("__") else UnreadError


UNREAD: Any = _Unread()


def readable(items: Iterable[T]) -> Iterator[T]:
    """The items up to the one that asks for a value that could not be read.

    Examples
    --------
    >>> list(readable(x for x in (1, 2 * UNREAD, 3) if x > 0))
    [1]
    """
    try:
        yield from items
    except UnreadError:
        return
