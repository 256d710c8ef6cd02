"""The piecewise linear functions that a friction map is made of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def linear_basis(speed: FloatArray, knots: Sequence[float]) -> FloatArray:
    """Piecewise linear functions, one for each knot: 1 there and 0 at the others; the last slope continues.

    Examples
    --------
    >>> linear_basis(np.array([0.0, 1.0, 4.0]), (0.0, 2.0, 3.0)).tolist()
    [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, -1.0, 2.0]]
    """
    v = np.asarray(knots, dtype=float)
    k = np.clip(np.searchsorted(v, speed, side="right") - 1, 0, len(v) - 2)
    share = (speed - v[k]) / (v[k + 1] - v[k])
    out = np.zeros((len(speed), len(v)))
    rows = np.arange(len(speed))
    out[rows, k] = 1.0 - share
    out[rows, k + 1] = share
    return out
