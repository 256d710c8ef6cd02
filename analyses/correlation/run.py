"""Records against the model: the figures of each, and of all together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.types import Progress
from analyses.correlation.asked import Asked
from analyses.correlation.closed_loop import CorrelationResult, correlate_record
from analyses.correlation.compare import SignalComparison
from analyses.records.open_record import open_records
from analyses.records.record import named_apart

BESIDE = ("speed", "velocity", "current", "force")  # beside the motion, in the first sentence too


@dataclass(frozen=True, kw_only=True)
class SignalSummary:
    """One signal over all records that hold it, all samples together."""

    name: str
    unit: str
    records: int
    samples: int
    mean_error: float
    rms_error: float
    max_error: float
    relative_error: float  # norm of all differences over the norm of all that was measured
    share_of_motion: float  # over that of each record's about its mean
    worst: str  # the record with the largest of these


def _of_signal(name: str, results: Sequence[CorrelationResult]) -> SignalSummary:
    there = [result for result in results if name in result.signals]
    signals = [result[name] for result in there]
    whole = np.concatenate([one.measured for one in signals])
    off = np.concatenate([one.modelled for one in signals]) - whole
    motion = np.concatenate([one.measured - one.measured.mean() for one in signals])
    size, norm = np.linalg.norm(off), np.linalg.norm(whole)
    return SignalSummary(
        name=name,
        unit=signals[0].unit,
        records=len(signals),
        samples=len(off),
        mean_error=float(np.mean(np.abs(off))),
        rms_error=float(np.sqrt(np.mean(off**2))),
        max_error=float(np.max(np.abs(off))),
        relative_error=float(size / norm),
        share_of_motion=float(size / (np.linalg.norm(motion) or norm)),
        worst=max(there, key=lambda result: result[name].share_of_motion).record,
    )


def worst_of(results: Sequence[CorrelationResult]) -> tuple[CorrelationResult, SignalComparison]:
    """The record whose motion is furthest off, and the signal: the output's place where it is recorded."""
    every = [(result, signal) for result in results for signal in result.signals.values()]
    for name in ("output_angle", "position", "angle", "speed", "velocity"):
        if all(name in result.signals for result in results):
            every = [(result, result[name]) for result in results]
            break
    return max(every, key=lambda pair: pair[1].share_of_motion)


def follows_model(result: CorrelationResult) -> bool:
    """Whether the model's motion, speed and drive each fit better than the measured mean: above 0 %."""
    compared = [worst_of([result])[1], *(result[name] for name in BESIDE if name in result.signals)]
    return all(signal.share_beyond_noise <= 1.0 for signal in compared)


@dataclass(frozen=True)
class Correlation:
    """A model against records."""

    design: Design
    asked: Asked
    records: tuple[CorrelationResult, ...]

    @property
    def limit(self) -> float:
        """Largest error allowed, over the measured signal about its mean."""
        return self.asked.error_limit / 100.0

    @property
    def summary(self) -> dict[str, SignalSummary]:
        """The figures of every signal over all records, in the order in which the signals first occur."""
        return {name: _of_signal(name, self.records) for one in self.records for name in one.signals}

    @property
    def worst(self) -> str:
        """The record whose motion is furthest off."""
        return worst_of(self.records)[0].record

    @property
    def passed(self) -> bool:
        """Whether no record contradicts itself or the design, and each signal is within the limit."""
        if any(finding.passed is False for one in self.records for finding in one.findings):
            return False
        signals = [signal for one in self.records for signal in one.signals.values()]
        within = all(signal.share_beyond_noise <= self.limit for signal in signals)
        return within and all(follows_model(one) for one in self.records)


def correlate(design: Design, asked: Asked, *, progress: Progress = None) -> Correlation:
    """Run the model with each record's own command, load and supply, and compare."""
    records = named_apart([record for path in asked.records for record in open_records(path)])
    results = (correlate_record(design, one, command=asked.command, progress=progress) for one in records)
    return Correlation(design, asked, tuple(results))
