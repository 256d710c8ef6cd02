"""How far a measurement may lie from a prediction: what it may be off by itself."""

from __future__ import annotations

from typing import overload

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
SURE = 3.0  # times its own error: that is an estimate, from two readings of the same measurement
PREDICTED = 1e-5  # relative: figures of the linear loops are searched for to 1e-6 and better


@overload
def allowed(error: float, size: float) -> float: ...


@overload
def allowed(error: Floats, size: float) -> Floats: ...


def allowed(error: float | Floats, size: float) -> float | Floats:
    """Tolerance of a comparison, in the unit of both: from the errors of measurement and prediction.

    Examples
    --------
    >>> round(allowed(0.001, 10.0), 12)
    0.0031
    """
    return SURE * error + PREDICTED * abs(size)
