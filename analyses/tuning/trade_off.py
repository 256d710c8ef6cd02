"""Position bandwidth against the smallest phase margin of all loops, other requirements kept."""

from __future__ import annotations

import numpy as np

from analyses.monte_carlo.judging import loops_of
from analyses.tuning.problem import Problem
from analyses.tuning.result import TradeOffPoint
from analyses.tuning.solve import maximise

POINTS = 6
_SPAN = (0.6, 1.6)
_MET = -1e-3


def trade_off(problem: Problem, gains: np.ndarray, working: np.ndarray) -> tuple[TradeOffPoint, ...]:
    """Largest smallest phase margin (all loops, worst corner) for position bandwidths around the tuned one.

    From gains in SI; the result holds for the corners that are looked at, ``working``.
    """
    others = [
        k for k, r in enumerate(problem.requirements)
        if r.quantity != "phase_margin" and not (r.quantity == "bandwidth" and r.loop in ("position", None))
    ]  # fmt: skip
    centre = float(np.min(problem.figure("bandwidth", "position", gains[None, :], working)))
    if not np.isfinite(centre):
        return ()
    targets = [float(hz) for hz in centre * np.geomspace(*_SPAN, POINTS)]
    result: list[np.ndarray] = []
    for wanted in targets:
        starts = [gains, *result[-1:]]
        tried = [_best(problem, start, working, wanted, others) for start in starts]
        result.append(_better(problem, [*starts, *tried], working, wanted, others))
    for k in range(len(targets) - 2, -1, -1):  # what a higher bandwidth allows, a lower one does too
        result[k] = _better(problem, result[k : k + 2], working, targets[k], others)
    points = [_point(problem, one, working, others) for one in result]
    return tuple(point for point in points if np.isfinite(point.bandwidth_hz))


def _margins(problem: Problem, rows: np.ndarray, working: np.ndarray) -> np.ndarray:
    """Phase margins, shape (candidates, loops * corners); 180 without crossing."""
    result = [problem.figure("phase_margin", loop, rows, working) for loop in loops_of(problem.design)]
    return np.clip(np.concatenate(result, axis=1), -180.0, 180.0)


def _better(
    problem: Problem, candidates: list[np.ndarray], working: np.ndarray, wanted_hz: float, others: list[int]
) -> np.ndarray:
    """Of some gains those with the largest phase margin that keep the bandwidth and the other limits."""
    rows = np.array(candidates)
    width = problem.figure("bandwidth", "position", rows, working)
    margin = _margins(problem, rows, working).min(axis=1)
    short = np.minimum(np.where(np.isnan(width), -3.0, width / wanted_hz - 1.0).min(axis=1) - _MET, 0.0)
    if others:
        kept = problem.distances(rows, working)[:, :, others].min(axis=(1, 2))
        short = short + np.minimum(kept - _MET, 0.0)
    return rows[int(np.lexsort((-margin, -short))[0])]


def _best(
    problem: Problem, start: np.ndarray, working: np.ndarray, wanted_hz: float, others: list[int]
) -> np.ndarray:
    """Largest phase margin at a bandwidth or above, other requirements kept."""

    def goal(x: np.ndarray) -> np.ndarray:
        return _margins(problem, problem.values(x), working) / 45.0

    def limits(x: np.ndarray) -> np.ndarray:
        width = problem.figure("bandwidth", "position", problem.values(x), working)
        kept = [np.where(np.isnan(width), -3.0, width / wanted_hz - 1.0)]
        if others:
            kept.append(problem.distances(problem.values(x), working)[:, :, others].reshape(len(x), -1))
        return np.concatenate(kept, axis=1)

    return maximise(problem, start, limits, goal, iterations=30)


def _point(problem: Problem, gains: np.ndarray, working: np.ndarray, others: list[int]) -> TradeOffPoint:
    row = gains[None, :]
    width = float(np.min(problem.figure("bandwidth", "position", row, working)))
    margin = float(_margins(problem, row, working).min())
    kept = problem.distances(row, working)[0][:, others]
    return TradeOffPoint(width, margin, bool(kept.size == 0 or kept.min() >= _MET))
