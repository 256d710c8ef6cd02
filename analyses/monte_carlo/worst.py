"""The worst design in the tolerance region: corners, the worst samples, then differential evolution.

Sampling alone finds no worst case: the chance that a point lands near a corner of a box of many dimensions is
small.  The search starts from the corners and the worst samples, and never returns less bad than the worst of
them.  Correlated parameters stay together (`analyses.monte_carlo.region`).  Storn and Price 1997
(`scipy.optimize.differential_evolution`), then Nelder and Mead.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from analyses.monte_carlo.judging import judge
from analyses.monte_carlo.region import Region
from analyses.monte_carlo.result import WorstCase
from analyses.monte_carlo.task import SampleTask

if TYPE_CHECKING:
    from actuator_lti.design.model import Requirement

MOST_CORNERS = 1024
GENERATIONS = 40  # of the evolution
_UNSTABLE = -1e6  # stands for a distance of - infinity, so that the optimiser can compare


def corners(lower: np.ndarray, upper: np.ndarray, seed: int) -> np.ndarray:
    """Corners of a box, shape (corners, dimensions): all, or a random 1024 where there are more."""
    size = len(lower)
    if 2**size <= MOST_CORNERS:
        choice = np.array(list(product((False, True), repeat=size)))
    else:
        choice = np.random.default_rng(seed).integers(0, 2, (MOST_CORNERS, size)).astype(bool)
    return np.where(choice, upper, lower)


def distances(task: SampleTask, requirement: Requirement, points: np.ndarray) -> np.ndarray:
    """Distance to the limit of designs at points (SI), shape (count,)."""
    judged = judge(requirement, task.design, task.figures(points)).distance
    return np.where(np.isneginf(judged), _UNSTABLE, judged)


def worst_case(task: SampleTask, requirement: Requirement, worst_samples: np.ndarray) -> WorstCase:
    """Make the worst samples (by their numbers, worst first) worse."""
    from scipy.optimize import differential_evolution, minimize

    region = Region(task.sampler)
    size = region.dimensions
    looked_at = 0

    def cost(unit: np.ndarray) -> np.ndarray:
        nonlocal looked_at
        points = region.values(np.atleast_2d(unit.T))
        looked_at += len(points)
        return distances(task, requirement, points)

    drawn = np.vstack([task.sampler.draw(int(k), 1) for k in worst_samples])
    edges = corners(np.zeros(size), np.ones(size), task.sampler.seed)
    pool = np.vstack([edges, region.cube(drawn)])
    distance = cost(pool.T)
    many = max(12, min(40, 4 * size))
    population = _padded(pool[np.argsort(distance, kind="stable")[:many]], many, task.sampler.seed)
    result = differential_evolution(
        cost, [(0.0, 1.0)] * size, init=population, maxiter=GENERATIONS, tol=1e-10, polish=False,
        vectorized=True, updating="deferred", rng=np.random.default_rng(task.sampler.seed),
    )  # fmt: skip
    fine = minimize(
        lambda x: float(cost(x[:, None])[0]), result.x, method="Nelder-Mead",
        bounds=[(0.0, 1.0)] * size,
        options={"maxfev": 60 * size, "xatol": 1e-9, "fatol": 1e-12},
    )  # fmt: skip
    candidates = np.vstack([fine.x, result.x, pool[np.argmin(distance)]])
    best = candidates[np.argmin(cost(candidates.T))]
    return _described(task, requirement, region.values(best[None])[0], int(worst_samples[0]), looked_at)


def _padded(points: np.ndarray, size: int, seed: int) -> np.ndarray:
    """Fill up a population with random points; shake equal ones apart."""
    rng = np.random.default_rng(seed)
    missing = size - len(points)
    if missing > 0:
        points = np.vstack([points, rng.uniform(size=(missing, points.shape[1]))])
    return points


def _described(
    task: SampleTask, requirement: Requirement, point: np.ndarray, sample: int, evaluations: int
) -> WorstCase:
    drawn = task.sampler.draw(sample, 1)
    judged = judge(requirement, task.design, task.figures(np.vstack([drawn[0], point])))
    sampled, value = (float(v) for v in judged.value)
    distance = float(judged.distance[1])
    return WorstCase(
        requirement.id,
        requirement.unit,
        sampled if np.isfinite(sampled) else None,
        sample,
        value if np.isfinite(distance) else None,
        distance if np.isfinite(distance) else None,
        bool(judged.passed[1]),
        dict(zip(task.sampler.paths, (float(v) for v in point), strict=True)),
        evaluations,
    )
