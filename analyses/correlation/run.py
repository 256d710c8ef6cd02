"""Every record against the model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from actuator_lti.design.model import Design
from analyses.correlation.asked import Asked
from analyses.correlation.closed_loop import CorrelationResult, correlate_record
from analyses.correlation.summary import SignalSummary, agrees, summarise, worst_of
from analyses.records import open_records
from analyses.records.record import named_apart


@dataclass(frozen=True)
class Correlation:
    """A model against records."""

    design: Design
    asked: Asked
    records: tuple[CorrelationResult, ...]

    @property
    def limit(self) -> float | None:
        """Largest error allowed, over the measured signal about its mean."""
        return None if self.asked.error_limit is None else self.asked.error_limit / 100.0

    @property
    def summary(self) -> dict[str, SignalSummary]:
        """The figures of every signal over all records."""
        return summarise(self.records)

    @property
    def worst(self) -> str:
        """The record whose motion is furthest off."""
        return worst_of(self.records)[0].record

    @property
    def passed(self) -> bool:
        """Whether no record contradicts itself or the design, and no error is above the limit."""
        return agrees(self.records, self.limit)


def correlate(
    design: Design, asked: Asked, *, progress: Callable[[int, int], None] | None = None
) -> Correlation:
    """Run the model with each record's own command, load and supply, and compare."""
    records = [record for path in asked.records for record in open_records(path)]
    results = [
        correlate_record(design, record, command=asked.command, progress=progress)
        for record in named_apart(records)
    ]
    return Correlation(design, asked, tuple(results))
