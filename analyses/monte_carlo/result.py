"""What a Monte Carlo study returns: distributions of figures, odds of requirements, worst cases.

A column is kept in at most ``MOST`` bins: the bits of a floating-point number in their order are a whole
number in its order, and a bin is all numbers whose first bits agree, as many as it takes. That number depends
on the values alone, so sketches of parts merge into that of the whole, to the bit, in whatever order.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import inf
from pathlib import Path

import numpy as np
from scipy.special import betaincinv

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.design.asked import Waiver
from actuator_lti.errors import InputError
from analyses.specification.requirements import RequirementVerdict, tally

SHARES = (0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999)
CONFIDENCE = 0.95
PROVEN_SHARE = 0.95  # of the designs, that samples alone have to show where nothing else is asked
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
    count: int  # in all; then without the figure; where it is infinite (no limit)
    missing: int
    infinite: int
    mean: float  # of the finite values, as the next
    std: float
    minimum: float
    maximum: float
    shares: tuple[float, ...]
    quantiles: tuple[float, ...]
    edges: tuple[float, ...]  # histogram of the finite values
    counts: tuple[int, ...]


def column_statistics(name: str, unit: str, sketch: Sketch) -> ColumnStatistics:
    infinite = sketch.low + sketch.high
    defined = sketch.finite + infinite
    ranks = [min(max(int(np.ceil(share * defined)) - 1, 0), defined - 1) for share in SHARES if defined]
    low, high = (sketch.minimum, sketch.maximum) if sketch.finite else (np.nan, np.nan)
    return ColumnStatistics(
        name, unit, defined + sketch.missing, sketch.missing, infinite, *sketch.moments(), low, high,
        SHARES if ranks else (), tuple(sketch.order_statistics(ranks)), *sketch.histogram(),
    )  # fmt: skip


def clopper_pearson(passed: int, count: int) -> tuple[float, float]:
    """Lower and upper bound of a probability from passes in independent trials, each with 95 % confidence.

    Each alone holds at least as often as it claims. For points of a scrambled Sobol sequence the share of
    passes scatters less than that of independent trials, so they are on the safe side. Clopper and Pearson
    1934, one-sided.

    >>> round(clopper_pearson(300, 300)[0], 5)  # 0.05^(1/300)
    0.99006
    """
    if not 0 <= passed <= count or count == 0:
        raise InputError(f"{passed} of {count}: passes must lie between 0 and the number of samples")
    low = 0.0 if passed == 0 else float(betaincinv(passed, count - passed + 1, 1.0 - CONFIDENCE))
    high = 1.0 if passed == count else float(betaincinv(passed + 1, count - passed, CONFIDENCE))
    return low, high


def samples_needed(probability: float) -> float:
    """How many samples prove a probability if all pass: p^n <= 5 %; infinitely many for certainty.

    >>> samples_needed(0.95), samples_needed(0.99), samples_needed(1.0)
    (59, 299, inf)
    """
    return inf if probability >= 1.0 else math.ceil(math.log(1.0 - CONFIDENCE) / math.log(probability))


_NONE = np.empty(0, dtype=np.int64)


@dataclass(frozen=True)
class Sketch:
    """Counts of the finite values by bins, and of those that are not finite."""

    dropped: int = 0  # last bits that a bin does not tell apart (0: every value is kept)
    keys: np.ndarray = field(default_factory=lambda: _NONE)  # occupied bins in increasing order
    counts: np.ndarray = field(default_factory=lambda: _NONE)
    missing: int = 0
    low: int = 0
    high: int = 0
    minimum: float = math.inf  # without a finite value the wrong way round
    maximum: float = -math.inf

    @classmethod
    def of(cls, values: np.ndarray) -> Sketch:
        finite = values[np.isfinite(values)] + 0.0  # no minus zero
        bits = finite.view(np.int64)
        keys, counts = np.unique(np.where(bits < 0, bits ^ _LAST_63, bits), return_counts=True)
        return cls(
            *_bounded(0, keys, counts.astype(np.int64)), missing=int(np.isnan(values).sum()),
            low=int(np.isneginf(values).sum()), high=int(np.isposinf(values).sum()),
            minimum=float(finite.min(initial=math.inf)), maximum=float(finite.max(initial=-math.inf)),
        )  # fmt: skip

    def merged(self, other: Sketch) -> Sketch:
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
        """Edges and counts of bins of equal width, twice the cube root of the values, for drawing."""
        if not self.maximum > self.minimum:
            return ((self.minimum, self.maximum), (self.finite,)) if self.finite else ((), ())
        bins = min(SHOWN_BINS, math.ceil(2.0 * self.finite ** (1.0 / 3.0)))
        edges = np.linspace(self.minimum, self.maximum, bins + 1)
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


@dataclass(frozen=True)
class Odds:
    """How often a requirement is met within the tolerances."""

    id: str  # of the requirement; ``"all"`` for all of them together
    label: str
    unit: str
    passed: int
    count: int
    probability: float  # share of passes; its bounds of 95 % (Clopper and Pearson; safe for Sobol points)
    low: float
    high: float
    minimum: float | None = None  # the limit
    maximum: float | None = None
    nominal: float | None = None  # value of the nominal design; the worst of all samples
    worst: float | None = None
    worst_sample: int | None = None  # its number
    columns: tuple[str, ...] = ()  # columns that the requirement looks at
    waiver: Waiver | None = None  # which lets go that it is not proven
    unresolved: int = 0  # of the samples: rounding decides whether a loop is stable

    @property
    def failed(self) -> int:
        """Number of samples that do not meet it."""
        return self.count - self.passed - self.unresolved


@dataclass(frozen=True)
class WorstCase:
    """The worst design for a requirement that sampling and then an optimiser found in the tolerance box."""

    requirement: str
    unit: str
    sampled: float | None  # worst of all samples, and its number
    sample: int
    value: float | None  # after the optimiser; ``None`` where a loop is unstable there
    distance: float | None  # to the limit, positive where it is still met; ``None`` where unstable
    passed: bool | None  # ``None``: rounding decides whether a loop is stable
    parameters: Mapping[str, float]  # SI values of the worst design
    evaluations: int  # designs that the optimiser looked at
    file: Path | None = None  # design file of it


@dataclass(frozen=True)
class Driver:
    """What one tolerance alone does to a figure."""

    column: str
    path: str
    low_value: float  # ends of its range (three standard deviations of a normal one), SI
    high_value: float
    low: float | None  # the figure there, in its unit; ``None`` where there is none
    high: float | None

    @property
    def swing(self) -> float:
        """Distance between the figure at both ends; infinite where it is lost at one."""
        if self.low is None or self.high is None:
            return 0.0 if self.low == self.high else inf
        return abs(self.high - self.low)


@dataclass(frozen=True)
class MonteCarloResult:
    """A finished study."""

    design_name: str
    design_hash: str
    samples: int
    seed: int
    paths: tuple[str, ...]  # parameters that varied
    columns: Mapping[str, ColumnStatistics]
    odds: tuple[Odds, ...]  # one a requirement, as in the file; then all together (id ``"all"``)
    worst: tuple[WorstCase, ...]
    folder: Path  # every sample as Parquet, up to `KEPT`; the worst designs
    nominal: Mapping[str, float]  # the figures of the nominal design, by column
    left_out: tuple[RequirementVerdict, ...] = ()  # not sampled: not met by the nominal design, or not proven
    # Probability of meeting a requirement, with 95 % confidence, that is enough; without it every sample and
    # the worst case have to (where none was sought, so many samples that they prove `PROVEN_SHARE`)
    at_least: float | None = None
    notes: tuple[str, ...] = ()
    drivers: tuple[Driver, ...] = ()  # of each required figure every tolerance alone, the strongest first
    load_unit: str = "N m"  # of the loads in the names of columns
    unstable: float = 0.0  # share of the samples whose outermost loop, the drive as a whole, is not stable
    unresolved: float = 0.0  # and of those where rounding decides whether it is

    @property
    def tally(self) -> Tally:
        """The requirements counted."""
        each = [odds for odds in self.odds if odds.id != "all"]
        return Tally.of(map(self.judged, each), [o.waiver is not None for o in each]) + tally(self.left_out)

    @property
    def verdict(self) -> Verdict:
        """That of all requirements, and of whether enough drives are stable."""
        most = 0.0 if self.at_least is None else 1.0 - self.at_least
        passed = None if self.unstable <= most < self.unstable + self.unresolved else self.unstable <= most
        return (self.tally + Tally.of([Verdict.of(passed)])).verdict

    def case(self, odds: Odds) -> WorstCase | None:
        """The worst case of a requirement, where one was sought."""
        return next((case for case in self.worst if case.requirement == odds.id), None)

    @property
    def enough(self) -> float:
        """The probability that samples alone have to prove."""
        return PROVEN_SHARE if self.at_least is None else self.at_least

    def judged(self, odds: Odds) -> Verdict:
        """Whether a requirement is met: in every sample and the worst case, or as often as is enough."""
        case = self.case(odds)
        if self.at_least is None and (case is not None or odds.failed):
            passed = case.passed if case is not None and not odds.unresolved else None
            return Verdict.of(False if odds.failed or (case and case.passed is False) else passed)
        proven, refuted = odds.low >= self.enough, odds.high < self.enough
        return Verdict.of(proven if proven or refuted else None)

    def __str__(self) -> str:
        lines = [f"{self.design_name}: {self.samples} samples, seed {self.seed}"]
        for o in self.odds:
            shares = f"at least {100 * o.low:.2f}, at most {100 * o.high:.2f}"
            lines.append(f"{o.id}: {100 * o.probability:.2f} % ({shares})")
        return "\n".join(lines)
