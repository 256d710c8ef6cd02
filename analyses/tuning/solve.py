"""The optimiser: the largest common distance to all requirements, corner by corner as it needs them.

Maximise t, up to a reserve of 30 %, with every requirement at every corner of the working set at least t
away from its limit (relative to the limit's size), by sequential quadratic programming (Kraft 1988, SLSQP)
with central differences of all gains in one compiled batch. Then all corners are looked at, the worst join
the working set, and again.  Deviation from the rule gains costs a little, so that among all gains with that
reserve those nearest to the rules are taken: margins beyond it are not worth a loop that only saturates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analyses.tuning.problem import Problem
from analyses.tuning.program import RESERVE, TIE, maximise

ROUNDS = 6


@dataclass(frozen=True)
class Solution:
    """Gains and how far they stay from every limit.

    Attributes
    ----------
    gains : ndarray
        SI.
    slack : float
        Smallest relative distance over all corners and requirements; negative where one is missed.
    working : ndarray
        Corners that mattered.
    """

    gains: np.ndarray
    slack: float
    working: np.ndarray


def solve(problem: Problem, *, give_up: bool = False) -> Solution:
    """Maximise the smallest relative distance to the limits over all corners.

    Parameters
    ----------
    problem : Problem
    give_up : bool
        Whether to stop where already the nominal design misses a limit.
    """
    corners = problem.all_corners
    working = corners[:1]
    starts = start_points(problem, working)
    best: Solution | None = None
    for _ in range(ROUNDS):
        gains = _best_of([_climb(problem, start, working) for start in starts], problem, working)
        result = problem.distances(gains[None, :], corners)[0]
        slack = float(result.min())
        if best is None or slack > best.slack:
            best = Solution(gains, slack, working)
        fresh = violated(result, problem, gains, corners, working)
        hopeless = give_up and float(problem.distances(gains[None, :], working).min()) < 0.0
        if not len(fresh) or hopeless or problem.spent:
            break
        working = np.vstack([working, fresh])
        starts = gains[None, :]
    assert best is not None
    return best


def start_points(problem: Problem, working: np.ndarray) -> np.ndarray:
    """The rule gains, those of the design, and the best of a coarse search around both."""
    rng = np.random.default_rng(0)
    centres = np.vstack([problem.coordinates(problem.start), problem.coordinates(problem.present)])
    spread = rng.uniform(-2.5, 2.5, (400, centres.shape[1]))
    rows = np.vstack([centres, centres[np.arange(400) % 2] + spread])
    cloud = np.clip(problem.values(rows), problem.lower, problem.upper)
    slack = problem.distances(cloud, working).min(axis=(1, 2))
    order = np.argsort(-slack, kind="stable")
    return np.vstack([cloud[:1], cloud[order[:2]]])


def _best_of(candidates: list[np.ndarray], problem: Problem, working: np.ndarray) -> np.ndarray:
    gains = np.array(candidates)
    away = np.sum((problem.coordinates(gains) - problem.coordinates(problem.start)) ** 2, axis=1)
    slack = np.minimum(problem.distances(gains, working).min(axis=(1, 2)), RESERVE) - TIE * away
    return gains[int(np.argmax(slack))]


def violated(
    result: np.ndarray, problem: Problem, gains: np.ndarray, corners: np.ndarray, working: np.ndarray
) -> np.ndarray:
    """For each requirement its worst corner, where it is worse than in the working set."""
    known = problem.distances(gains[None, :], working)[0].min()
    fresh = []
    for k in range(result.shape[1]):
        worst = int(np.argmin(result[:, k]))
        if result[worst, k] < known - 1e-6 and not _among(corners[worst], working):
            fresh.append(corners[worst])
    return np.unique(np.array(fresh), axis=0) if fresh else np.empty((0, corners.shape[1]))


def _among(corner: np.ndarray, working: np.ndarray) -> bool:
    return bool(np.any(np.all(working == corner, axis=1)))


def _climb(problem: Problem, start: np.ndarray, working: np.ndarray) -> np.ndarray:
    """Maximise t subject to distances >= t, from one start."""

    def limits(x: np.ndarray) -> np.ndarray:
        return problem.distances(problem.values(x), working).reshape(len(x), -1)

    return maximise(problem, start, limits)
