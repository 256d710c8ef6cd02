"""Runs that do not belong: a robust fit, and residuals too large for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analyses.estimation.arrays import FloatArray

LEVEL = 0.01


@dataclass(frozen=True, kw_only=True)
class FoundOutliers:
    """Rows and their residuals in robust standard deviations, and the limit which they exceed."""

    rows: tuple[int, ...]
    standardised: FloatArray
    limit: float


def find_outliers(x: FloatArray, y: FloatArray, variance: FloatArray, shared: FloatArray) -> FoundOutliers:
    """Rows whose residual from a robust fit is too large.

    Huber's estimate, started from least absolute deviations, on rows divided by their standard deviation; the
    scale is the median absolute deviation, but not less than what the rows' own noise gives. The limit is the
    normal quantile for a false alarm in 1 % of all campaigns (Bonferroni).

    Parameters
    ----------
    x, y, variance : array, shape (n, p), (n,), (n,)
        Regressors, torques and the variance of each row's own noise.
    shared : array, shape (n, k)
        What the bounds of the shared errors do to the rows. They are estimated along with the coefficients,
        within their bounds, so that an error of an instrument does not make outliers of all runs that used
        it.
    """
    from scipy.stats import norm

    w = 1.0 / np.sqrt(variance)
    a = with_shared(x * w[:, None], shared * w[:, None])
    b = np.concatenate([y * w, np.zeros(shared.shape[1])])
    weight = np.ones(len(b))
    scale = 1.0
    rest = b
    for step in range(30):
        root = np.sqrt(weight)
        rest = b - a @ np.linalg.lstsq(a * root[:, None], b * root, rcond=None)[0]
        scale = max(1.4826 * float(np.median(np.abs(rest[: len(y)]))), 1.0)
        size = np.maximum(np.abs(rest[: len(y)]) / scale, 1e-6)
        weight[: len(y)] = 1.0 / size if step < 15 else np.minimum(1.0, 1.345 / size)
    limit = float(norm.isf(0.5 * LEVEL / len(y)))
    standardised = rest[: len(y)] / scale
    rows = np.flatnonzero(np.abs(standardised) > limit)
    return FoundOutliers(rows=tuple(int(k) for k in rows), standardised=standardised[rows], limit=limit)


def with_shared(x: FloatArray, shared: FloatArray) -> FloatArray:
    """Regressors beside the shared errors, and a row for each shared error that holds it to its bound.

    The unknowns that belong to the columns of ``shared`` have a variance of 1/3, that of a uniform error
    within its bound.
    """
    held = np.zeros((shared.shape[1], x.shape[1] + shared.shape[1]))
    held[:, x.shape[1] :] = np.sqrt(3.0) * np.eye(shared.shape[1])
    return np.vstack([np.column_stack([x, shared]), held])
