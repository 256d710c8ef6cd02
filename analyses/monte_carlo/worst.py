"""The worst design in the tolerance region: corners, the worst samples, then differential evolution.

Sampling alone finds no worst case: the chance that a point lands near a corner of a box of many dimensions is
small.  The search starts from the corners and the worst samples, and never returns less bad than the worst of
them.  Correlated parameters stay together (`analyses.monte_carlo.worst`).  Storn and Price 1997
(`scipy.optimize.differential_evolution`), then Nelder and Mead.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.special import chdtri, ndtr, ndtri

from actuator_lti.design.model import Requirement
from analyses.finite import finite
from analyses.monte_carlo.judging import judge
from analyses.monte_carlo.result import WorstCase
from analyses.monte_carlo.task import SampleTask
from analyses.studies.sampling import BOX_SIGMA, Factor, Sampler

_LEAST = 1e-9  # of an eigenvalue of a correlation matrix: below, the direction does not exist


@dataclass(frozen=True)
class Group:
    """Parameters that are correlated: columns of a draw, and the axes of their ellipsoid in scores.

    ``s = axes e`` with ``|e| <= radius``; axes of shape (len(columns), rank).
    """

    columns: tuple[int, ...]
    axes: np.ndarray
    radius: float

    @classmethod
    def of(cls, columns: tuple[int, ...], correlation: np.ndarray) -> Group:
        """The group of some columns, from the correlation matrix of all."""
        values, vectors = np.linalg.eigh(correlation[np.ix_(columns, columns)])
        kept = values > _LEAST
        axes = vectors[:, kept] * np.sqrt(values[kept])
        rank = axes.shape[1]
        inside = (2.0 * ndtr(BOX_SIGMA) - 1.0) ** rank
        return cls(columns, axes, float(np.sqrt(chdtri(rank, 1.0 - inside))))

    def scores(self, cube: np.ndarray) -> np.ndarray:
        """Scores at points of the unit cube, shape (count, rank); its faces are the ellipsoid's surface."""
        x = 2.0 * cube - 1.0
        length = np.linalg.norm(x, axis=1, keepdims=True)
        share = np.max(np.abs(x), axis=1, keepdims=True) / np.maximum(length, 1e-300)
        return np.asarray(self.radius * share * x @ self.axes.T)

    def cube(self, scores: np.ndarray) -> np.ndarray:
        """Points of the unit cube for scores; those beyond the ellipsoid are brought back to it."""
        e = scores @ np.linalg.pinv(self.axes).T / self.radius
        length = np.linalg.norm(e, axis=1, keepdims=True)
        largest = np.maximum(np.max(np.abs(e), axis=1, keepdims=True), 1e-300)
        x = e / largest * np.minimum(length, 1.0)
        return np.asarray(0.5 + 0.5 * x)


@dataclass(frozen=True)
class Region:
    """A region of parameters as a picture of the unit cube."""

    sampler: Sampler

    @cached_property
    def alone(self) -> tuple[int, ...]:
        """Columns of the parameters without correlation."""
        return tuple(k for k in range(len(self.sampler.factors)) if len(self._set_of(k)) == 1)

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """The sets of parameters that hang together by correlations."""
        sets = {self._set_of(k) for k in range(len(self.sampler.factors)) if k not in self.alone}
        return tuple(Group.of(columns, self.sampler.correlation) for columns in sorted(sets))

    def _set_of(self, k: int) -> tuple[int, ...]:
        result, new = {k}, [k]
        while new:
            near = np.flatnonzero(self.sampler.correlation[new.pop()]).tolist()
            new += [j for j in near if j not in result]
            result.update(near)
        return tuple(sorted(result))

    @property
    def dimensions(self) -> int:
        """Coordinates of the unit cube."""
        ranks = sum(group.axes.shape[1] for group in self.groups)
        return len(self.alone) + ranks + (self.sampler.table is not None)

    def values(self, cube: np.ndarray) -> np.ndarray:
        """SI values at points of the unit cube, shape (count, dimensions), columns as `Sampler.paths`."""
        sampler = self.sampler
        cube = np.clip(cube, 0.0, 1.0)
        lower, upper = sampler.box
        out = np.empty((len(cube), len(sampler.paths)))
        for j, k in enumerate(self.alone):
            out[:, k] = lower[k] + cube[:, j] * (upper[k] - lower[k])
        at = len(self.alone)
        for group in self.groups:
            rank = group.axes.shape[1]
            scores = group.scores(cube[:, at : at + rank])
            for column, score in zip(group.columns, scores.T, strict=True):
                result = sampler.factors[column].quantile(_probability(sampler.factors[column], score, group))
                out[:, column] = np.clip(result, lower[column], upper[column])
            at += rank
        if sampler.table is not None:
            rows = sampler.table.rows
            chosen = np.minimum((cube[:, at] * len(rows)).astype(int), len(rows) - 1)
            out[:, len(sampler.factors) :] = rows[chosen]
        return out

    def cube(self, values: np.ndarray) -> np.ndarray:
        """Points of the unit cube for values, shape (count, len(paths)); from outside, the nearest within."""
        sampler = self.sampler
        lower, upper = sampler.box
        parts = [
            ((values[:, k] - lower[k]) / (upper[k] - lower[k]) if upper[k] > lower[k] else 0.0 * values[:, k])
            for k in self.alone
        ]
        for group in self.groups:
            scores = [_score(sampler.factors[k], values[:, k], group) for k in group.columns]
            parts += list(group.cube(np.column_stack(scores)).T)
        if sampler.table is not None:
            rows, size = sampler.table.rows, len(sampler.factors)
            nearest = [int(np.argmin(np.sum((rows - one) ** 2, axis=1))) for one in values[:, size:]]
            parts.append((np.array(nearest) + 0.5) / len(rows))
        return np.clip(np.column_stack(parts), 0.0, 1.0)


def _probability(factor: Factor, score: np.ndarray, group: Group) -> np.ndarray:
    """Cumulative probability of a score; a uniform parameter reaches its edges where the ellipsoid does."""
    if factor.tolerance.kind != "uniform":
        return np.asarray(ndtr(score))
    low = ndtr(-group.radius)
    return np.asarray((ndtr(score) - low) / (1.0 - 2.0 * low))


def _score(factor: Factor, value: np.ndarray, group: Group) -> np.ndarray:
    """The score of a value, the inverse of `_probability` and `Factor.quantile`."""
    t = factor.tolerance
    if t.kind == "uniform":
        low = ndtr(-group.radius)
        share = np.clip(0.5 + 0.5 * (value - factor.nominal) / float(t.half_width or 1.0), 0.0, 1.0)
        return np.asarray(ndtri(low + share * (1.0 - 2.0 * low)))
    std = float(t.std or 1.0)
    score = (value - factor.nominal) / std
    if t.kind == "truncated-normal":
        low, high = ndtr((t.lower - factor.nominal) / std), ndtr((t.upper - factor.nominal) / std)
        score = ndtri(np.clip((ndtr(score) - low) / (high - low), 1e-300, 1.0 - 1e-16))
    return np.asarray(score)


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
    rng = np.random.default_rng(task.sampler.seed)
    chosen = pool[np.argsort(distance, kind="stable")[:many]]
    population = np.vstack([chosen, rng.uniform(size=(many - len(chosen), size))])
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
        finite(sampled),
        sample,
        value if np.isfinite(distance) else None,
        finite(distance),
        bool(judged.passed[1]),
        dict(zip(task.sampler.paths, (float(v) for v in point), strict=True)),
        evaluations,
    )
