"""Runs that do not belong: a robust fit, and residuals too large for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LEVEL = 0.01


@dataclass(frozen=True, kw_only=True)
class FoundOutliers:
    """Rows and their residuals in robust standard deviations, and the limit which they exceed."""

    rows: tuple[int, ...]
    standardised: FloatArray
    limit: float


def find_outliers(x: FloatArray, y: FloatArray, variance: FloatArray) -> FoundOutliers:
    """Rows whose residual from a robust fit is too large.

    Huber's estimate, started from least absolute deviations, on rows divided by their standard deviation; the
    scale is the median absolute deviation, but not less than what the rows' own noise gives. The limit is the
    normal quantile for a false alarm in 1 % of all campaigns (Bonferroni).
    """
    from scipy.stats import norm

    w = 1.0 / np.sqrt(variance)
    a, b = x * w[:, None], y * w
    weight = np.ones(len(y))
    scale = 1.0
    rest = b
    for step in range(30):
        root = np.sqrt(weight)
        rest = b - a @ np.linalg.lstsq(a * root[:, None], b * root, rcond=None)[0]
        scale = max(1.4826 * float(np.median(np.abs(rest))), 1.0)
        size = np.maximum(np.abs(rest) / scale, 1e-6)
        weight = 1.0 / size if step < 15 else np.minimum(1.0, 1.345 / size)
    limit = float(norm.isf(0.5 * LEVEL / len(y)))
    standardised = rest / scale
    rows = np.flatnonzero(np.abs(standardised) > limit)
    return FoundOutliers(rows=tuple(int(k) for k in rows), standardised=standardised[rows], limit=limit)
