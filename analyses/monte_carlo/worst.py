"""The worst design in the tolerance region: corners, the worst samples, then differential evolution.

Samples hardly land near a corner of many dimensions. Storn and Price 1997
(`scipy.optimize.differential_evolution`), then Nelder and Mead; never less bad than where it starts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.optimize import differential_evolution, minimize
from scipy.sparse.csgraph import connected_components
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
    """Parameters that are correlated: columns of a draw, and the axes of their ellipsoid in scores."""

    columns: tuple[int, ...]
    axes: np.ndarray  # shape (len(columns), rank): ``s = axes e`` with ``|e| <= radius``
    radius: float

    @classmethod
    def of(cls, columns: tuple[int, ...], correlation: np.ndarray) -> Group:
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
    def sets(self) -> list[tuple[int, ...]]:
        """Columns that hang together by correlations; of a parameter without one it is alone."""
        _, of = connected_components(self.sampler.correlation != 0.0, directed=False)
        return sorted(tuple(np.flatnonzero(of == one).tolist()) for one in set(of.tolist()))

    @cached_property
    def alone(self) -> tuple[int, ...]:
        """Columns of the parameters without correlation."""
        return tuple(columns[0] for columns in self.sets if len(columns) == 1)

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """The sets of parameters that hang together by correlations."""
        return tuple(Group.of(columns, self.sampler.correlation) for columns in self.sets if len(columns) > 1)

    @property
    def dimensions(self) -> int:
        ranks = sum(group.axes.shape[1] for group in self.groups)
        return len(self.alone) + ranks + (self.sampler.table is not None)

    def values(self, cube: np.ndarray) -> np.ndarray:
        """SI values at points of the unit cube, shape (count, dimensions), columns as `Sampler.paths`."""
        sampler, cube = self.sampler, np.clip(cube, 0.0, 1.0)
        lower, upper = sampler.box
        out = np.empty((len(cube), len(sampler.paths)))
        at = len(self.alone)
        for j, k in enumerate(self.alone):
            out[:, k] = lower[k] + cube[:, j] * (upper[k] - lower[k])
        for group in self.groups:
            rank = group.axes.shape[1]
            for k, score in zip(group.columns, group.scores(cube[:, at : at + rank]).T, strict=True):
                factor = sampler.factors[k]
                out[:, k] = np.clip(factor.quantile(_probability(factor, score, group)), lower[k], upper[k])
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
        width = np.where(upper > lower, upper - lower, np.inf)
        parts = [(values[:, k] - lower[k]) / width[k] for k in self.alone]
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
        share = np.clip(0.5 + 0.5 * (value - factor.nominal) / t.width, 0.0, 1.0)
        return np.asarray(ndtri(low + share * (1.0 - 2.0 * low)))
    score = (value - factor.nominal) / t.width
    if t.kind == "truncated-normal":
        low, high = ndtr((t.lower - factor.nominal) / t.width), ndtr((t.upper - factor.nominal) / t.width)
        score = ndtri(np.clip((ndtr(score) - low) / (high - low), 1e-300, 1.0 - 1e-16))
    return np.asarray(score)


MOST_CORNERS = 1024
GENERATIONS = 40  # of the evolution
STEP = float(np.cbrt(np.finfo(float).eps))  # of differences, of the whole range
_FAR = 1e6  # stands for an infinite distance (of a drive that is not stable: below 0), to be compared


def corners(size: int, seed: int) -> np.ndarray:
    """Corners of the unit cube, shape (corners, size): all, or a random 1024 where there are more."""
    if 2**size <= MOST_CORNERS:
        return np.array(list(product((0.0, 1.0), repeat=size)))
    return np.random.default_rng(seed).integers(0, 2, (MOST_CORNERS, size)).astype(float)


def worst_case(task: SampleTask, requirement: Requirement, worst_samples: np.ndarray) -> WorstCase:
    """Make the worst samples (by their numbers, worst first) worse."""
    region, looked_at = Region(task.sampler), 0

    def distance(unit: np.ndarray) -> np.ndarray:
        """To the limit, at points of the unit cube, shape (dimensions, count)."""
        nonlocal looked_at
        points = region.values(np.atleast_2d(unit.T))
        looked_at += len(points)
        judged = judge(requirement, task.design, task.figures(points)).resolved
        return np.where(np.isinf(judged), np.copysign(_FAR, judged), judged)

    drawn = np.vstack([task.sampler.draw(int(k), 1) for k in worst_samples])
    pool = np.vstack([corners(region.dimensions, task.sampler.seed), region.cube(drawn)])
    point = region.values(_smallest(distance, pool, task.sampler.seed)[None])[0]
    both = judge(requirement, task.design, task.figures(np.vstack([drawn[0], point])))
    return WorstCase(
        requirement=requirement.id,
        unit=requirement.unit,
        sampled=finite(both.value[0]),
        sample=int(worst_samples[0]),
        value=float(both.value[1]) if np.isfinite(both.distance[1]) else None,
        distance=finite(both.distance[1]),
        passed=None if both.unresolved[1] else bool(both.passed[1]),
        parameters=dict(zip(task.sampler.paths, point.tolist(), strict=True)),
        evaluations=looked_at,
    )


def _smallest(cost: Callable[[np.ndarray], np.ndarray], pool: np.ndarray, seed: int) -> np.ndarray:
    """The point of the unit cube with the smallest cost, from the best of a pool on."""
    found, size = cost(pool.T), pool.shape[1]
    many = max(12, min(40, 4 * size))
    chosen = pool[np.argsort(found, kind="stable")[:many]]
    more = np.random.default_rng(seed).uniform(size=(many - len(chosen), size))
    result = differential_evolution(
        cost, [(0.0, 1.0)] * size, init=np.vstack([chosen, more]), maxiter=GENERATIONS, tol=1e-10,
        polish=False, vectorized=True, updating="deferred", rng=np.random.default_rng(seed),
    )  # fmt: skip
    fine = minimize(
        lambda x: _with_slopes(cost, x), result.x, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * size
    )
    candidates = np.vstack([fine.x, result.x, pool[np.argmin(found)]])
    return np.asarray(candidates[np.argmin(cost(candidates.T))])


def _with_slopes(cost: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> tuple[float, np.ndarray]:
    """A cost and its differences about a point of the unit cube, one-sided at its faces, in one look."""
    moves = STEP * np.eye(len(x))
    ahead, behind = np.minimum(x + moves, 1.0), np.maximum(x - moves, 0.0)
    values = cost(np.vstack([x, ahead, behind]).T)
    after, before = np.split(values[1:], 2)
    return float(values[0]), (after - before) / np.diag(ahead - behind)
