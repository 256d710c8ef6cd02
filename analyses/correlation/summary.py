"""Several records against one design: the figures of each, and of all together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analyses.correlation.closed_loop import CorrelationResult
from analyses.correlation.compare import SignalComparison

BESIDE = ("speed", "velocity", "current", "force")
"""Signals that stand beside the motion, in the first sentence too."""


@dataclass(frozen=True, kw_only=True)
class SignalSummary:
    """One signal over all records that hold it.

    ``mean_error`` and ``rms_error`` are over all samples together, ``max_error`` the largest of all,
    ``relative_error`` the norm of all differences over the norm of all that was measured. ``worst`` is the
    record with the largest relative error.
    """

    name: str
    unit: str
    records: int
    samples: int
    mean_error: float
    rms_error: float
    max_error: float
    relative_error: float
    worst: str


def summarise(results: Sequence[CorrelationResult]) -> dict[str, SignalSummary]:
    """The figures of every signal over all records, in the order in which the signals first occur."""
    return {name: _of_signal(name, results) for result in results for name in result.signals}


def _of_signal(name: str, results: Sequence[CorrelationResult]) -> SignalSummary:
    outcome = [(result, result[name]) for result in results if name in result.signals]
    signals = [signal for _, signal in outcome]
    samples = np.array([signal.samples for signal in signals])
    squared = np.array([signal.rms_error**2 for signal in signals]) * samples
    measured = np.array([float(np.sum(signal.measured**2)) for signal in signals])
    worst = max(outcome, key=lambda pair: pair[1].relative_error)
    return SignalSummary(
        name=name,
        unit=signals[0].unit,
        records=len(signals),
        samples=int(samples.sum()),
        mean_error=float(np.array([signal.mean_error for signal in signals]) @ samples / samples.sum()),
        rms_error=float(np.sqrt(squared.sum() / samples.sum())),
        max_error=max(signal.max_error for signal in signals),
        relative_error=float(np.sqrt(squared.sum() / measured.sum())),
        worst=worst[0].record,
    )


def worst_of(results: Sequence[CorrelationResult]) -> tuple[CorrelationResult, SignalComparison]:
    """The record whose motion is furthest off, and the signal: the output's place where it is recorded."""
    every = [(result, signal) for result in results for signal in result.signals.values()]
    for name in ("output_angle", "position", "angle", "speed", "velocity"):
        if all(name in result.signals for result in results):
            every = [(result, result[name]) for result in results]
            break
    return max(every, key=lambda pair: pair[1].share_of_motion)


def moves_alike(result: CorrelationResult) -> bool:
    """Whether the model's motion, speed and drive each fit better than the measured mean: above 0 %."""
    told = [worst_of([result])[1], *(result[name] for name in BESIDE if name in result.signals)]
    return all(signal.share_of_motion <= 1.0 for signal in told)


def agrees(results: Sequence[CorrelationResult], error_limit: float | None) -> bool:
    """Whether no record contradicts itself or the design, each motion fits and, with a limit, each signal is
    within that share of its motion."""
    if any(finding.passed is False for result in results for finding in result.findings):
        return False
    signals = [signal for result in results for signal in result.signals.values()]
    within = error_limit is None or all(signal.share_of_motion <= error_limit for signal in signals)
    return within and all(moves_alike(result) for result in results)
