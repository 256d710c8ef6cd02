"""Statistics of a column, and the interval of a probability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv

from actuator_lti.errors import InputError
from analyses.monte_carlo.sketch import Sketch

SHARES = (0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999)
CONFIDENCE = 0.95


@dataclass(frozen=True)
class ColumnStatistics:
    """Distribution of one figure.

    A quantile is the smallest sample value with at least that share of the defined samples at or below it:
    exact for up to `sketch.MOST` samples, of more to one of as many bins.

    Attributes
    ----------
    count, missing, infinite : int
        Samples in all; without the figure (unstable, no crossing to quote); where it is infinite (no limit).
    mean, std : float
        Of the finite values.
    minimum, maximum : float
    shares, quantiles : tuple of float
    edges, counts : tuple
        Histogram of the finite values.
    """

    name: str
    unit: str
    count: int
    missing: int
    infinite: int
    mean: float
    std: float
    minimum: float
    maximum: float
    shares: tuple[float, ...]
    quantiles: tuple[float, ...]
    edges: tuple[float, ...]
    counts: tuple[int, ...]


def column_statistics(name: str, unit: str, sketch: Sketch) -> ColumnStatistics:
    """Statistics of a column from its sketch."""
    infinite = sketch.low + sketch.high
    defined = sketch.finite + infinite
    ranks = [min(max(int(np.ceil(share * defined)) - 1, 0), defined - 1) for share in SHARES if defined]
    low, high = (sketch.minimum, sketch.maximum) if sketch.finite else (np.nan, np.nan)
    return ColumnStatistics(
        name, unit, defined + sketch.missing, sketch.missing, infinite, *sketch.moments(), low, high,
        SHARES if ranks else (), tuple(sketch.order_statistics(ranks)), *sketch.histogram(),
    )  # fmt: skip


def clopper_pearson(passed: int, count: int) -> tuple[float, float]:
    """Interval (95 %) of a probability from passes in independent trials; covers at least as it claims.

    For points of a scrambled Sobol sequence the share of passes scatters less than that of independent
    trials, so the interval is on the safe side. Clopper and Pearson 1934.

    Examples
    --------
    >>> low, high = clopper_pearson(100, 100)
    >>> round(low, 4), high
    (0.9638, 1.0)
    """
    if not 0 <= passed <= count or count == 0:
        raise InputError(f"{passed} of {count}: passes must lie between 0 and the number of samples")
    tail = 0.5 * (1.0 - CONFIDENCE)
    low = 0.0 if passed == 0 else float(betaincinv(passed, count - passed + 1, tail))
    high = 1.0 if passed == count else float(betaincinv(passed + 1, count - passed, 1.0 - tail))
    return low, high
