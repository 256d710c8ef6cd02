"""Kinds of arguments and results that many functions share."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Real = NDArray[np.floating[Any]]
Complex = NDArray[np.complexfloating[Any, Any]]
Mask = NDArray[np.bool_]
Ints = NDArray[np.int64]
Progress = Callable[[int, int], None] | None
"""Called with (done, total) while long work goes on; None: nobody looks on."""
