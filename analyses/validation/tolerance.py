"""How far a measurement may lie from a prediction: what it may be off by itself."""

from __future__ import annotations

SURE = 3.0  # times its own error: that is an estimate, from two readings of the same measurement
PREDICTED = 1e-5  # relative: figures of the linear loops are searched for to 1e-6 and better


def allowed(error: float, size: float) -> float:
    """Tolerance of a comparison, in the unit of both: from the errors of measurement and prediction.

    Examples
    --------
    >>> round(allowed(0.001, 10.0), 12)
    0.0031
    """
    return SURE * error + PREDICTED * abs(size)
