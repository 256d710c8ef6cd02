"""Kinds of arguments and results that many functions share."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from actuator_lti.errors import CHECKED

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Real = NDArray[np.floating[Any]]
Complex = NDArray[np.complexfloating[Any, Any]]
Mask = NDArray[np.bool_]
Ints = NDArray[np.int64]
Delay = Annotated[float, CHECKED]
Progress = Callable[[int, int], None] | None
"""Called with (done, total) while long work goes on; None: nobody looks on."""


def number_array(given: Any) -> Floats:
    """Numbers of any shape as floats.

    A TypeError or ValueError for what is none, and for text, which numpy would read.
    """
    if np.asarray(given).dtype.kind in "SU":
        raise TypeError
    return np.asarray(given, dtype=float)


class Compared:
    """A dataclass (``eq=False``) that holds arrays: equal where all its fields are, nan as nan; no hash."""

    __hash__: ClassVar[None]  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        names: Any = [one.name for one in fields(self) if one.compare]  # type: ignore[arg-type]
        return all(_equal(getattr(self, name), getattr(other, name)) for name in names)


def _equal(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(a, b, equal_nan=True)
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(_equal(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple) and type(a) is type(b):
        return len(a) == len(b) and all(map(_equal, a, b))
    return bool(a == b or (a != a and b != b))
