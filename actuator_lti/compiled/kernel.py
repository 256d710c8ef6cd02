"""The mark of a function that is compiled: written in the subset of Python that becomes C.

It runs in Python as it stands, slowly: for a debugger, and as the reference of the compiled form.
"""

from collections.abc import Callable
from typing import Any, TypeVar

Written = TypeVar("Written", bound=Callable[..., Any])
_MARK, _SELDOM, _WIDE = "is_kernel", "is_seldom", "is_wide"


def kernel(function: Written) -> Written:
    """Mark a function of the subset."""
    setattr(function, _MARK, True)
    return function


def seldom(function: Written) -> Written:
    """Mark a kernel that is called where something happens: `Form` leaves it as it is."""
    setattr(function, _SELDOM, True)
    return function


def wide(function: Written) -> Written:
    """Mark a kernel whose loop becomes vector instructions: it is there for AVX2 too."""
    setattr(function, _WIDE, True)
    return function


def is_wide(value: object) -> bool:
    """Whether something is marked by `wide`."""
    return bool(getattr(value, _WIDE, False))


def is_seldom(value: object) -> bool:
    """Whether something is marked by `seldom`."""
    return bool(getattr(value, _SELDOM, False))


def is_kernel(value: object) -> bool:
    """Whether something is a function that `kernel` has marked."""
    return callable(value) and getattr(value, _MARK, False)
