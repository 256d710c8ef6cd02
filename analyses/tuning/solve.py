"""The optimiser: the largest common distance to all requirements, corner by corner as it needs them.

Maximise t, up to a reserve of 30 %, with every requirement at every corner of the working set at least t
away from its limit (relative to the limit's size), by sequential quadratic programming (Kraft 1988, SLSQP)
with central differences of all gains in one compiled batch. Then all corners are looked at, the worst join
the working set, and again.  Deviation from the rule gains costs a little, so that among all gains with that
reserve those nearest to the rules are taken: margins beyond it are not worth a loop that only saturates.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from analyses.tuning.problem import Problem

_STEP = 1e-4  # of ln(gain), central differences
_TIE = 2e-3  # what a deviation from the rules by a factor e costs
ROUNDS = 6
RESERVE = 0.3  # relative distance to a limit that is enough


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


def solve(problem: Problem, starts: np.ndarray | None = None) -> Solution:
    """Maximise the smallest relative distance to the limits over all corners."""
    corners = problem.all_corners
    working = corners[:1]
    if starts is None:
        starts = start_points(problem, working)
    best: Solution | None = None
    for _ in range(ROUNDS):
        gains = _best_of([_climb(problem, start, working) for start in starts], problem, working)
        found = problem.distances(gains[None, :], corners)[0]
        slack = float(found.min())
        if best is None or slack > best.slack:
            best = Solution(gains, slack, working)
        fresh = _violated(found, problem, gains, corners, working)
        if not len(fresh):
            break
        working = np.vstack([working, fresh])
        starts = gains[None, :]
    assert best is not None
    return best


def start_points(problem: Problem, working: np.ndarray) -> np.ndarray:
    """The rule gains, those of the design, and the best of a coarse search around the rules."""
    rng = np.random.default_rng(0)
    size = len(problem.paths)
    cloud = problem.start * np.exp(rng.uniform(-2.5, 2.5, (400, size)))
    cloud = np.clip(np.vstack([problem.start, cloud]), problem.lower, problem.upper)
    slack = problem.distances(cloud, working).min(axis=(1, 2))
    order = np.argsort(-slack, kind="stable")[:2]
    return np.vstack([problem.start, cloud[order]])


def _best_of(candidates: list[np.ndarray], problem: Problem, working: np.ndarray) -> np.ndarray:
    gains = np.array(candidates)
    away = np.sum(np.log(gains / problem.start) ** 2, axis=1)
    slack = np.minimum(problem.distances(gains, working).min(axis=(1, 2)), RESERVE) - _TIE * away
    return gains[int(np.argmax(slack))]


def _violated(
    found: np.ndarray, problem: Problem, gains: np.ndarray, corners: np.ndarray, working: np.ndarray
) -> np.ndarray:
    """For each requirement its worst corner, where it is worse than in the working set."""
    known = problem.distances(gains[None, :], working)[0].min()
    fresh = []
    for k in range(found.shape[1]):
        worst = int(np.argmin(found[:, k]))
        if found[worst, k] < known - 1e-6 and not _among(corners[worst], working):
            fresh.append(corners[worst])
    return np.unique(np.array(fresh), axis=0) if fresh else np.empty((0, corners.shape[1]))


def _among(corner: np.ndarray, working: np.ndarray) -> bool:
    return bool(np.any(np.all(working == corner, axis=1)))


def _climb(problem: Problem, start: np.ndarray, working: np.ndarray) -> np.ndarray:
    """Maximise t subject to distances >= t, from one start."""

    def limits(x: np.ndarray) -> np.ndarray:
        return problem.distances(np.exp(x), working).reshape(len(x), -1)

    return maximise(problem, start, limits)


def maximise(
    problem: Problem,
    start: np.ndarray,
    limits: Callable[[np.ndarray], np.ndarray],
    free: Callable[[np.ndarray], np.ndarray] | None = None,
    iterations: int = 80,
) -> np.ndarray:
    """Maximise the smallest of some functions subject to others being positive.

    Parameters
    ----------
    limits : callable
        ``(candidates, gains as logarithms) -> (candidates, functions)``. Without ``free`` their smallest is
        maximised; with it they are constraints.
    free : callable, optional
        Functions whose smallest is maximised instead.
    """
    from scipy.optimize import minimize

    rule, size = np.log(problem.start), len(start)
    low, high = np.log(problem.lower), np.log(problem.upper)
    kept: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def both(x: np.ndarray) -> np.ndarray:
        goal = limits(x) if free is None else free(x)
        return goal if free is None else np.concatenate([goal, limits(x)], axis=1)

    aims = limits(np.log(start)[None, :]).shape[1] if free is None else free(np.log(start)[None, :]).shape[1]

    def model(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        key = x.tobytes()
        if key not in kept:
            moves = np.vstack([np.zeros(size), _STEP * np.eye(size), -_STEP * np.eye(size)])
            values = both(x[None, :] + moves)
            slope = (values[1 : size + 1] - values[size + 1 :]) / (2 * _STEP)
            kept.clear()
            kept[key] = (values[0], slope.T)
        return kept[key]

    def constraint(y: np.ndarray) -> np.ndarray:
        values = model(y[:size])[0].copy()
        values[:aims] -= y[size]
        return values

    def constraint_slope(y: np.ndarray) -> np.ndarray:
        slope = model(y[:size])[1]
        last = np.zeros((len(slope), 1))
        last[:aims] = -1.0
        return np.hstack([slope, last])

    def cost(y: np.ndarray) -> float:
        return float(-y[size] + _TIE * np.sum((y[:size] - rule) ** 2))

    def cost_slope(y: np.ndarray) -> np.ndarray:
        return np.concatenate([2 * _TIE * (y[:size] - rule), [-1.0]])

    x0 = np.clip(np.log(start), low, high)
    first = float(model(x0)[0][:aims].min())
    if free is None:
        first = min(first, RESERVE)
    done = minimize(
        cost, np.append(x0, first), jac=cost_slope, method="SLSQP",
        bounds=[*zip(low, high, strict=True), (None, RESERVE if free is None else None)],
        constraints={"type": "ineq", "fun": constraint, "jac": constraint_slope},
        options={"maxiter": iterations, "ftol": 1e-9},
    )  # fmt: skip
    return np.exp(np.clip(done.x[:size], low, high))
