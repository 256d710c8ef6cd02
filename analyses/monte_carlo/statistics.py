"""Statistics of columns that may not fit in memory, the same to the last bit however they are cut."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.special import betaincinv

from actuator_lti.errors import InputError

SHARES = (0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999)
BINS = 4096
CONFIDENCE = 0.95
SHOWN_BINS = 60

Blocks = Callable[[], Iterable[Mapping[str, np.ndarray]]]


@dataclass(frozen=True)
class ColumnStatistics:
    """Distribution of one figure.

    Quantiles are sample values: the smallest with at least that share of the defined samples at or below it.

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


@dataclass
class _Running:
    """What three passes over a column collect."""

    count: int = 0
    missing: int = 0
    high: int = 0  # + infinity
    low: int = 0  # - infinity
    total: float = 0.0
    square: float = 0.0
    minimum: float = np.inf
    maximum: float = -np.inf
    histogram: np.ndarray = field(default_factory=lambda: np.zeros(BINS, dtype=np.int64))
    wanted: tuple[int, ...] = ()
    kept: list[np.ndarray] = field(default_factory=list)

    @property
    def finite(self) -> int:
        return self.count - self.missing - self.high - self.low

    @property
    def mean(self) -> float:
        return self.total / self.finite if self.finite else np.nan

    def first_pass(self, values: np.ndarray) -> None:
        finite = values[np.isfinite(values)]
        self.count += len(values)
        self.missing += int(np.isnan(values).sum())
        self.high += int(np.isposinf(values).sum())
        self.low += int(np.isneginf(values).sum())
        self.total += float(finite.sum())
        if len(finite):
            self.minimum = min(self.minimum, float(finite.min()))
            self.maximum = max(self.maximum, float(finite.max()))

    def bins(self, values: np.ndarray) -> np.ndarray:
        """Bin of each finite value; monotone, so that order statistics can be found bin by bin."""
        width = self.maximum - self.minimum
        if not width > 0.0:
            return np.zeros(len(values), dtype=np.int64)
        return np.minimum(((values - self.minimum) * (BINS / width)).astype(np.int64), BINS - 1)

    def second_pass(self, values: np.ndarray) -> None:
        finite = values[np.isfinite(values)]
        self.square += float(((finite - self.mean) ** 2).sum())
        self.histogram += np.bincount(self.bins(finite), minlength=BINS)

    def choose(self, ranks: Iterable[int]) -> None:
        """Note the bins that hold the wanted ranks (from 0, among the finite values)."""
        ends = np.cumsum(self.histogram)
        result = {int(np.searchsorted(ends, r, side="right")) for r in ranks if 0 <= r < self.finite}
        self.wanted = tuple(sorted(result)) if self.maximum > self.minimum else ()

    def third_pass(self, values: np.ndarray) -> None:
        finite = values[np.isfinite(values)]
        self.kept.append(finite[np.isin(self.bins(finite), self.wanted)])

    def order_statistics(self, ranks: Iterable[int]) -> list[float]:
        """Values of the wanted ranks among all defined values, infinities at the ends."""
        ends = np.cumsum(self.histogram)
        before = ends - self.histogram
        kept = np.sort(np.concatenate(self.kept)) if self.kept else np.empty(0)
        bins = self.bins(kept)
        values = []
        for rank in ranks:
            inner = rank - self.low
            if inner < 0 or inner >= self.finite:
                values.append(-np.inf if inner < 0 else np.inf)
                continue
            if not self.maximum > self.minimum:
                values.append(self.minimum)
                continue
            which = int(np.searchsorted(ends, inner, side="right"))
            values.append(float(kept[bins == which][inner - before[which]]))
        return values

    def shown(self) -> tuple[tuple[float, ...], tuple[int, ...]]:
        """A coarser histogram for drawing."""
        if self.finite == 0:
            return (), ()
        if not self.maximum > self.minimum:
            return (self.minimum, self.maximum), (self.finite,)
        edges = np.linspace(0, BINS, SHOWN_BINS + 1).astype(int)
        counts = [int(self.histogram[a:b].sum()) for a, b in itertools.pairwise(edges)]
        scale = (self.maximum - self.minimum) / BINS
        return tuple(float(self.minimum + e * scale) for e in edges), tuple(counts)


def column_statistics(blocks: Blocks, units: Mapping[str, str]) -> dict[str, ColumnStatistics]:
    """Statistics of columns read three times, block by block; memory holds a few blocks.

    Parameters
    ----------
    blocks : callable
        Gives the columns from the beginning, in blocks whose cuts do not depend on how they were computed.
    units : mapping of str to str
        Columns wanted, with their units.
    """
    running = {name: _Running() for name in units}
    for block in blocks():
        for name, state in running.items():
            state.first_pass(block[name])
    for block in blocks():
        for name, state in running.items():
            state.second_pass(block[name])
    ranks = {name: _ranks(state) for name, state in running.items()}
    for name, state in running.items():
        state.choose(rank - state.low for rank in ranks[name])
    for block in blocks():
        for name, state in running.items():
            state.third_pass(block[name])
    return {name: _finished(name, units[name], state, ranks[name]) for name, state in running.items()}


def _ranks(state: _Running) -> list[int]:
    defined = state.count - state.missing
    if defined == 0:
        return []
    return [min(max(int(np.ceil(share * defined)) - 1, 0), defined - 1) for share in SHARES]


def _finished(name: str, unit: str, state: _Running, ranks: list[int]) -> ColumnStatistics:
    edges, counts = state.shown()
    return ColumnStatistics(
        name, unit, state.count, state.missing, state.high + state.low, state.mean,
        float(np.sqrt(state.square / (state.finite - 1))) if state.finite > 1 else np.nan,
        state.minimum if state.finite else np.nan, state.maximum if state.finite else np.nan,
        SHARES if ranks else (), tuple(state.order_statistics(ranks)), edges, counts,
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
