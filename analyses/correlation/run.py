"""Every record against the model, or a chirp predicted from steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from actuator_lti.design.model import Design
from analyses.correlation.asked import Asked
from analyses.correlation.chirp import ChirpPrediction, predict_chirp
from analyses.correlation.closed_loop import CorrelationResult, correlate_record
from analyses.correlation.summary import SignalSummary, agrees, summarise, worst_of
from analyses.correlation.voltage_motor import VoltageMotor, fit_step
from analyses.records import open_record
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


@dataclass(frozen=True)
class Prediction:
    """A motor fitted to steps, and what it says of a chirp."""

    motor: VoltageMotor
    chirp: ChirpPrediction
    record: str


def correlate(
    design: Design, asked: Asked, *, progress: Callable[[int, int], None] | None = None
) -> Correlation | Prediction:
    """Run the model with each record's own command, load and supply, and compare."""
    records = [open_record(path) for path in asked.records]
    if asked.predict is not None:
        motor = fit_step(records)
        return Prediction(motor, predict_chirp(motor, open_record(asked.predict)), asked.predict.name)
    results = [
        correlate_record(design, record, command=asked.command, progress=progress)
        for record in named_apart(records)
    ]
    return Correlation(design, asked, tuple(results))
