"""A smooth program over the logarithms of gains, for sequential quadratic programming."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from analyses.tuning.problem import Problem

STEP = 1e-4  # of ln(gain), central differences
TIE = 2e-3  # what a deviation from the rules by a factor e costs
RESERVE = 0.3  # relative distance to a limit that is enough
Functions = Callable[[np.ndarray], np.ndarray]


@dataclass
class Program:
    """Maximise t with some functions at least t and others at least zero.

    The unknowns are y = [ln gains, t]. Values and central differences of all functions come from one
    compiled batch.

    Attributes
    ----------
    problem : Problem
    goals, limits : callable
        ``(candidates, ln gains) -> (candidates, functions)``; ``limits`` may be None.
    """

    problem: Problem
    goals: Functions
    limits: Functions | None = None
    _last: tuple[bytes, np.ndarray, np.ndarray, int] | None = field(default=None, repr=False)

    @property
    def size(self) -> int:
        """Number of gains."""
        return len(self.problem.start)

    def model(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        """Values, slopes of all functions at ln gains, and how many of them are goals."""
        key = x.tobytes()
        if self._last is None or self._last[0] != key:
            moves = np.vstack([np.zeros(self.size), STEP * np.eye(self.size), -STEP * np.eye(self.size)])
            values = self.goals(x[None, :] + moves)
            aims = values.shape[1]
            if self.limits is not None:
                values = np.concatenate([values, self.limits(x[None, :] + moves)], axis=1)
            slopes = (values[1 : self.size + 1] - values[self.size + 1 :]) / (2 * STEP)
            self._last = (key, values[0], slopes.T, aims)
        return self._last[1:]

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
        return float(-y[-1] + TIE * np.sum((y[:-1] - np.log(self.problem.start)) ** 2))

    def cost_slope(self, y: np.ndarray) -> np.ndarray:
        """Derivatives of `cost`."""
        return np.append(2 * TIE * (y[:-1] - np.log(self.problem.start)), -1.0)


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
        ``(candidates, ln gains) -> (candidates, functions)``. Without ``free`` their smallest is maximised,
        up to the reserve of 30 %; with it they are constraints.
    free : callable, optional
        Functions whose smallest is maximised instead.
    """
    from scipy.optimize import minimize

    program = Program(problem, limits) if free is None else Program(problem, free, limits)
    most = RESERVE if free is None else None
    low, high = np.log(problem.lower), np.log(problem.upper)
    x0 = np.clip(np.log(start), low, high)
    values, _, aims = program.model(x0)
    first = float(values[:aims].min())
    done = minimize(
        program.cost, np.append(x0, first if most is None else min(first, most)), jac=program.cost_slope,
        method="SLSQP", bounds=[*zip(low, high, strict=True), (None, most)],
        constraints={"type": "ineq", "fun": program.constraint, "jac": program.constraint_slope},
        options={"maxiter": iterations, "ftol": 1e-9},
    )  # fmt: skip
    return np.exp(np.clip(done.x[:-1], low, high))
