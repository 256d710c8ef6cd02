"""Functions that numba compiles, without numba before the first of them is called.

Most commands run the kernels as a C library and never compile anything; importing numba and declaring some
two hundred functions to it takes a third of a second.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any


class CompiledLate:
    """A function declared to numba when it is first called, or when a compiled function calls it.

    Attributes
    ----------
    py_func : callable
        The function as written.

    Examples
    --------
    >>> def twice(x):
    ...     return 2.0 * x
    >>> import numba
    >>> late = CompiledLate(twice, numba.njit)
    >>> late(2.0), late.py_func(2.0)
    (4.0, 4.0)
    """

    def __init__(self, function: Callable[..., Any], declare: Callable[[Callable[..., Any]], Any]) -> None:
        update_wrapper(self, function)
        self.py_func = function
        self._declare = declare

    @cached_property
    def dispatcher(self) -> Any:
        """What numba makes of it."""
        return self._declare(self.py_func)

    @property
    def _numba_type_(self) -> Any:
        """What a compiled function sees: numba asks values that it does not know for this."""
        return self.dispatcher._numba_type_

    @property
    def targetoptions(self) -> Any:
        """Options of the declaration: numba looks here for ``inline``."""
        return self.dispatcher.targetoptions

    def __call__(self, *arguments: Any) -> Any:
        return self.dispatcher(*arguments)
