"""The distribution of a column of any length in a bounded number of bins; the interval of a probability.

Floating-point numbers in their order are whole numbers in their order (the bits of a positive one read as an
integer); a bin is all numbers whose first bits agree. As many last bits are dropped as it takes to have at
most ``MOST`` bins occupied, none for up to ``MOST`` different values. That number depends on the values
alone, so sketches of parts merge into that of the whole, to the bit, in whatever order.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from scipy.special import betaincinv

from actuator_lti.errors import InputError

SHARES = (0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999)
CONFIDENCE = 0.95
MOST = 16_384  # bins: up to so many samples every value is kept
SHOWN_BINS = 60
_LAST_63 = np.int64(2**63 - 1)


@dataclass(frozen=True)
class ColumnStatistics:
    """Distribution of one figure.

    A quantile is the smallest sample value with at least that share of the defined samples at or below it:
    exact for up to `MOST` samples, of more to one of as many bins.
    """

    name: str
    unit: str
    # Samples in all; without the figure (unstable, no crossing to quote); where it is infinite (no limit)
    count: int
    missing: int
    infinite: int
    # Of the finite values
    mean: float
    std: float
    minimum: float
    maximum: float
    shares: tuple[float, ...]
    quantiles: tuple[float, ...]
    # Histogram of the finite values
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


_NONE = np.empty(0, dtype=np.int64)


@dataclass(frozen=True)
class Sketch:
    """Counts of the finite values by bins, and of those that are not finite.

    ``dropped`` last bits a bin does not tell apart (0: every value is kept), ``keys`` are the occupied bins
    in increasing order. Without a finite value minimum and maximum are infinities the wrong way round.
    """

    dropped: int = 0
    keys: np.ndarray = field(default_factory=lambda: _NONE)
    counts: np.ndarray = field(default_factory=lambda: _NONE)
    missing: int = 0
    low: int = 0
    high: int = 0
    minimum: float = math.inf
    maximum: float = -math.inf

    @classmethod
    def of(cls, values: np.ndarray) -> Sketch:
        """The sketch of some values."""
        finite = values[np.isfinite(values)] + 0.0  # no minus zero
        bits = finite.view(np.int64)
        keys, counts = np.unique(np.where(bits < 0, bits ^ _LAST_63, bits), return_counts=True)
        return cls(
            *_bounded(0, keys, counts.astype(np.int64)), missing=int(np.isnan(values).sum()),
            low=int(np.isneginf(values).sum()), high=int(np.isposinf(values).sum()),
            minimum=float(finite.min(initial=math.inf)), maximum=float(finite.max(initial=-math.inf)),
        )  # fmt: skip

    def merged(self, other: Sketch) -> Sketch:
        """The sketch of the values of both."""
        dropped = max(self.dropped, other.dropped)
        keys = np.concatenate([one.keys >> (dropped - one.dropped) for one in (self, other)])
        counts = np.concatenate([self.counts, other.counts])
        order = np.argsort(keys, kind="stable")
        return Sketch(
            *_bounded(dropped, keys[order], counts[order]), self.missing + other.missing,
            self.low + other.low, self.high + other.high, min(self.minimum, other.minimum),
            max(self.maximum, other.maximum),
        )  # fmt: skip

    @property
    def finite(self) -> int:
        """How many values are finite."""
        return int(self.counts.sum())

    @property
    def values(self) -> np.ndarray:
        """One value for each bin, in increasing order: the one that is there, or the middle of the bin."""
        keys = (self.keys << self.dropped) + (1 << self.dropped >> 1)
        bits = np.where(keys < 0, keys ^ _LAST_63, keys)
        return np.asarray(np.clip(bits.view(np.float64), self.minimum, self.maximum))

    def moments(self) -> tuple[float, float]:
        """Mean and standard deviation of the finite values, NaN where there are too few."""
        count = self.finite
        if not count:
            return math.nan, math.nan
        _, exponent = math.frexp(max(-self.minimum, self.maximum))  # scaled by it no square overflows
        values = np.ldexp(self.values, -exponent)
        mean = math.fsum(values * self.counts) / count
        square = math.fsum((values - mean) ** 2 * self.counts)
        deviation = math.sqrt(square / (count - 1)) if count > 1 else math.nan
        return math.ldexp(mean, exponent), math.ldexp(deviation, exponent)

    def order_statistics(self, ranks: Iterable[int]) -> list[float]:
        """Values of ranks (from 0) among all that are defined, infinities at the ends."""
        ends = np.concatenate([[self.low], self.low + np.cumsum(self.counts)])
        values = np.concatenate([[-math.inf], self.values, [math.inf]])
        return [float(value) for value in values[np.searchsorted(ends, list(ranks), side="right")]]

    def histogram(self) -> tuple[tuple[float, ...], tuple[int, ...]]:
        """Edges and counts of bins of equal width, for drawing."""
        if not self.maximum > self.minimum:
            return ((self.minimum, self.maximum), (self.finite,)) if self.finite else ((), ())
        edges = np.linspace(self.minimum, self.maximum, SHOWN_BINS + 1)
        counts, _ = np.histogram(self.values, edges, weights=self.counts)
        return tuple(edges.tolist()), tuple(counts.tolist())


def _bounded(dropped: int, keys: np.ndarray, counts: np.ndarray) -> tuple[int, np.ndarray, np.ndarray]:
    """Drop as few more last bits of sorted keys as it takes; count equal keys together."""
    more = 0
    while np.count_nonzero(np.diff(keys >> more)) >= MOST:
        more += 1
    keys = keys >> more
    first = np.flatnonzero(np.diff(keys, prepend=keys[:1] - 1))
    return dropped + more, keys[first], np.add.reduceat(counts, first) if len(first) else counts
