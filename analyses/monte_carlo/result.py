"""What a Monte Carlo study returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path

from actuator_lti.asked.verdict import Tally, Verdict
from analyses.monte_carlo.statistics import ColumnStatistics
from analyses.specification.requirements import RequirementVerdict, tally


@dataclass(frozen=True)
class Odds:
    """How often a requirement is met within the tolerances."""

    # Of the requirement; ``"all"`` for all of them together
    id: str
    label: str
    unit: str
    passed: int
    count: int
    # Share of passes with its 95 % interval (Clopper and Pearson; on the safe side for Sobol points)
    probability: float
    low: float
    high: float
    # The limit
    minimum: float | None = None
    maximum: float | None = None
    # Value of the nominal design, and the worst of all samples
    nominal: float | None = None
    worst: float | None = None
    worst_sample: int | None = None  # its number
    columns: tuple[str, ...] = ()  # columns that the requirement looks at


@dataclass(frozen=True)
class WorstCase:
    """The worst design for a requirement that sampling and then an optimiser found in the tolerance box."""

    requirement: str
    unit: str
    # Worst of all samples, and its number
    sampled: float | None
    sample: int
    value: float | None  # after the optimiser; ``None`` where a loop is unstable there
    distance: float | None  # to the limit, positive where it is still met; ``None`` where unstable
    passed: bool
    parameters: Mapping[str, float]  # SI values of the worst design
    evaluations: int  # designs that the optimiser looked at
    file: Path | None = None  # design file of it


@dataclass(frozen=True)
class Driver:
    """What one tolerance alone does to a figure."""

    column: str
    path: str
    # Ends of the parameter's range (three standard deviations of a normal one), SI
    low_value: float
    high_value: float
    # The figure there, in its unit; ``None`` where there is none
    low: float | None
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
    # One a requirement, in the order of the design file; then all together (id ``"all"``)
    odds: tuple[Odds, ...]
    worst: tuple[WorstCase, ...]
    folder: Path  # every sample as Parquet, up to `KEPT`; the worst designs
    nominal: Mapping[str, float]  # the figures of the nominal design, by column
    # Requirements that are not judged, not proven, as each takes a computation of one design
    left_out: tuple[RequirementVerdict, ...] = ()
    # Probability of meeting a requirement, with 95 % confidence, that is enough; without it every sample and
    # the worst case have to
    at_least: float | None = None
    notes: tuple[str, ...] = ()
    # For each figure that a requirement looks at, every tolerance alone, the one that moves it most first
    drivers: tuple[Driver, ...] = ()

    @property
    def tally(self) -> Tally:
        """The requirements counted."""
        return Tally.of(self.judged(odds) for odds in self.odds if odds.id != "all") + tally(self.left_out)

    @property
    def verdict(self) -> Verdict:
        """That of all requirements."""
        return self.tally.verdict

    def case(self, odds: Odds) -> WorstCase | None:
        """The worst case of a requirement, where one was sought."""
        return next((case for case in self.worst if case.requirement == odds.id), None)

    def judged(self, odds: Odds) -> Verdict:
        """Whether a requirement is met: in every sample and the worst case, or as often as is enough."""
        if self.at_least is not None:
            return Verdict.of(odds.low >= self.at_least)
        case = self.case(odds)
        return Verdict.of(odds.passed == odds.count and (case is None or case.passed))

    def __str__(self) -> str:
        lines = [f"{self.design_name}: {self.samples} samples, seed {self.seed}"]
        lines += [
            f"{o.id}: {100 * o.probability:.2f} % ({100 * o.low:.2f} to {100 * o.high:.2f})"
            for o in self.odds
        ]
        return "\n".join(lines)
