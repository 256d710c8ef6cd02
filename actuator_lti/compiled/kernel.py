"""The marks of a function that is compiled: written in the subset of Python that becomes C.

It runs in Python as it stands, slowly: for a debugger, and as the reference of the compiled form. All
functions of a module that says ``KERNELS = True`` are kernels.
"""

from collections.abc import Callable
from typing import Any, Literal, TypeVar

Written = TypeVar("Written", bound=Callable[..., Any])
Mark = Literal["kernel", "seldom", "wide"]


def _marking(mark: Mark) -> Callable[[Written], Written]:
    def marked(function: Written) -> Written:
        setattr(function, f"is_{mark}", True)
        return function

    return marked


def is_marked(value: object, mark: Mark) -> bool:
    """Whether something is a function with a mark, its own or that of its module."""
    whole = mark == "kernel" and getattr(value, "__globals__", {}).get("KERNELS", False)
    return callable(value) and (whole or getattr(value, f"is_{mark}", False))


kernel = _marking("kernel")  # a function of the subset
seldom = _marking("seldom")  # a kernel that is called where something happens: `Form` leaves it as it is
wide = _marking("wide")  # a kernel whose loop becomes vector instructions: it is there for AVX2 too
