"""A smooth program over the coordinates of gains, for sequential quadratic programming."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from analyses.tuning.problem import Problem

STEP = 1e-4  # of a coordinate (ln of a gain), central differences
TIE = 2e-3  # what a deviation from the rules by a factor e costs
RESERVE = 0.3  # relative distance to a limit that is enough
Functions = Callable[[np.ndarray], np.ndarray]


class Spent(Exception):
    """A search has looked at as many designs as it may."""


@dataclass
class Program:
    """Maximise t with some functions at least t and others at least zero.

    The unknowns are y = [coordinates, t]. Values and central differences of all functions come from one
    compiled batch.

    Attributes
    ----------
    problem : Problem
    goals, limits : callable
        ``(candidates, coordinates) -> (candidates, functions)``; ``limits`` may be None.
    """

    problem: Problem
    goals: Functions
    limits: Functions | None = None
    seen: list[tuple[np.ndarray, float]] = field(default_factory=list, repr=False)
    _last: tuple[bytes, np.ndarray, np.ndarray, int] | None = field(default=None, repr=False)

    @property
    def size(self) -> int:
        """Number of gains."""
        return len(self.problem.start)

    def model(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        """Values, slopes of all functions at coordinates, and how many of them are goals."""
        key = x.tobytes()
        if self.problem.spent:
            raise Spent
        if self._last is None or self._last[0] != key:
            moves = np.vstack([np.zeros(self.size), STEP * np.eye(self.size), -STEP * np.eye(self.size)])
            values = self.goals(x[None, :] + moves)
            aims = values.shape[1]
            if self.limits is not None:
                values = np.concatenate([values, self.limits(x[None, :] + moves)], axis=1)
            slopes = (values[1 : self.size + 1] - values[self.size + 1 :]) / (2 * STEP)
            self._last = (key, values[0], slopes.T, aims)
            self.seen.append((x.copy(), float(values[0].min())))
        return self._last[1:]

    @property
    def best(self) -> np.ndarray:
        """Coordinates seen so far whose smallest value is largest."""
        return max(self.seen, key=lambda each: each[1])[0]

    def constraint(self, y: np.ndarray) -> np.ndarray:
        """Goals less t, then limits; all shall be positive."""
        values, _, aims = self.model(y[:-1])
        return np.concatenate([values[:aims] - y[-1], values[aims:]])

    def constraint_slope(self, y: np.ndarray) -> np.ndarray:
        """Derivatives of `constraint`."""
        _, slopes, aims = self.model(y[:-1])
        last = np.zeros((len(slopes), 1))
        last[:aims] = -1.0
        return np.hstack([slopes, last])

    def cost(self, y: np.ndarray) -> float:
        """-t and what the distance from the rules costs."""
        return float(-y[-1] + TIE * np.sum((y[:-1] - self._rules) ** 2))

    def cost_slope(self, y: np.ndarray) -> np.ndarray:
        """Derivatives of `cost`."""
        return np.append(2 * TIE * (y[:-1] - self._rules), -1.0)

    @property
    def _rules(self) -> np.ndarray:
        return self.problem.coordinates(self.problem.start)


def maximise(
    problem: Problem,
    start: np.ndarray,
    limits: Functions,
    free: Functions | None = None,
    iterations: int = 80,
) -> np.ndarray:
    """Maximise the smallest of some functions of the gains; returns the gains, SI.

    Parameters
    ----------
    start : ndarray
        Gains to start from, SI.
    limits : callable
        ``(candidates, coordinates) -> (candidates, functions)``. Without ``free`` their smallest is made as
        large as can be, up to the reserve of 30 %; with it they are constraints.
    free : callable, optional
        Functions whose smallest is maximised instead.
    """
    from scipy.optimize import minimize

    program = Program(problem, limits) if free is None else Program(problem, free, limits)
    most = RESERVE if free is None else None
    low, high = problem.coordinates(problem.lower), problem.coordinates(problem.upper)
    x0 = np.clip(problem.coordinates(start), low, high)
    if problem.spent:
        return problem.values(x0)
    values, _, aims = program.model(x0)
    first = float(values[:aims].min())
    met = {"type": "ineq", "fun": program.constraint, "jac": program.constraint_slope}
    bounds = [*zip(low, high, strict=True), (None, most)]
    settings = {"maxiter": iterations, "ftol": 1e-9}
    begin = np.append(x0, first if most is None else min(first, most))
    try:
        result = minimize(
            program.cost, begin, jac=program.cost_slope, method="SLSQP", bounds=bounds,
            constraints=met, options=settings,
        ).x[:-1]  # fmt: skip
    except Spent:
        result = program.best
    return problem.values(np.clip(result, low, high))
