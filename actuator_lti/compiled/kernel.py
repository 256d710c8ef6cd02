"""The mark of a function that is compiled: written in the subset of Python that becomes C.

It runs in Python as it stands, slowly: for a debugger, and as the reference of the compiled form.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

Written = TypeVar("Written", bound=Callable[..., Any])
_MARK = "is_kernel"


def kernel(function: Written) -> Written:
    """Mark a function of the subset."""
    setattr(function, _MARK, True)
    return function


def is_kernel(value: object) -> bool:
    """Whether something is a function that `kernel` has marked."""
    return callable(value) and getattr(value, _MARK, False)
