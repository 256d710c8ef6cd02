"""The optimiser: the largest common distance to all requirements, corner by corner as it needs them.

Maximise t, up to a reserve of 30 %, with every requirement at every corner of the working set at least t away
from its limit, by sequential quadratic programming (Kraft 1988, SLSQP), central differences of all gains in
one batch; the worst of all corners join, and again. Deviation from the rule gains costs a little: among all
gains with that reserve those nearest to the rules are taken.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.optimize import minimize

from actuator_lti.types import Floats
from analyses.monte_carlo.judging import loops_of
from analyses.tuning.problem import Problem
from analyses.tuning.result import TradeOffPoint

ROUNDS = 6
STEP = 1e-4  # of a coordinate (ln of a gain), central differences
TIE = 2e-3  # what a deviation from the rules by a factor e costs
RESERVE = 0.3  # relative distance to a limit that is enough
Functions = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Solution:
    """Gains (SI) and how far they stay from every limit."""

    gains: Floats
    slack: float  # smallest relative distance over all corners and requirements, negative where one is missed
    working: Floats  # the corners that mattered


Seeking = Callable[[Floats | None, Floats], Floats | None]


def rounds(problem: Problem, working: Floats, seek: Seeking) -> Iterator[Solution]:
    """Solutions on a working set that grows by corners that are missed, until ``seek`` gives no gains."""
    corners, gains = problem.all_corners, None
    for _ in range(ROUNDS):
        if (gains := seek(gains, working)) is None:
            return
        result = problem.distances(gains[None, :], corners)[0]
        fresh = violated(result, problem, gains, corners, working)
        yield Solution(gains, float(result.min()), working)
        if not len(fresh) or problem.spent:
            return
        working = np.vstack([working, fresh])


def solve(problem: Problem, *, give_up: bool = False) -> Solution:
    """Maximise the smallest distance over all corners; or ``give_up`` where the nominal design fails."""

    def seek(gains: Floats | None, working: Floats) -> Floats:
        starts = start_points(problem, working) if gains is None else gains[None, :]
        rows = partial(problem.rows, corners=working)
        found = np.array([maximise(problem, start, rows) for start in starts])
        away = np.sum((problem.coordinates(found) - problem.coordinates(problem.start)) ** 2, axis=1)
        near = np.minimum(problem.distances(found, working).min(axis=(1, 2)), RESERVE) - TIE * away
        return np.asarray(found[int(np.argmax(near))])

    made = []
    for one in rounds(problem, problem.all_corners[:1], seek):
        made.append(one)
        if give_up and float(problem.distances(one.gains[None, :], one.working).min()) < 0.0:
            break
    return max(made, key=lambda one: one.slack)


def start_points(problem: Problem, working: Floats) -> Floats:
    """The rule gains, those of the design, and the best of a coarse search around both."""
    rng = np.random.default_rng(0)
    centres = np.vstack([problem.coordinates(problem.start), problem.coordinates(problem.present)])
    spread = rng.uniform(-2.5, 2.5, (400, centres.shape[1]))
    rows = np.vstack([centres, centres[np.arange(400) % 2] + spread])
    cloud = np.clip(problem.values(rows), problem.lower, problem.upper)
    order = np.argsort(-problem.distances(cloud, working).min(axis=(1, 2)), kind="stable")
    return np.vstack([cloud[:1], cloud[order[:2]]])


def violated(result: Floats, problem: Problem, gains: Floats, corners: Floats, working: Floats) -> Floats:
    """For each requirement its worst corner, where it is worse than in the working set."""
    known = problem.distances(gains[None, :], working)[0].min()
    fresh = []
    for k in range(result.shape[1]):
        worst = int(np.argmin(result[:, k]))
        if result[worst, k] < known - 1e-6 and not (working == corners[worst]).all(axis=1).any():
            fresh.append(corners[worst])
    return np.unique(np.array(fresh), axis=0) if fresh else np.empty((0, corners.shape[1]))


class Spent(Exception):
    """A search has looked at as many designs as it may."""


@dataclass
class Program:
    """Functions of the coordinates with their central differences, all from one compiled batch."""

    problem: Problem
    goals: Functions  # (candidates, coordinates) -> (candidates, functions)
    limits: Functions | None = None
    seen: list[tuple[Floats, float]] = field(default_factory=list, repr=False)
    aims: int = 0  # how many functions are goals, the first ones
    _last: tuple[Floats, Floats] | None = field(default=None, repr=False)

    def model(self, x: Floats) -> tuple[Floats, Floats]:
        """Values and slopes of all functions at coordinates."""
        if self.problem.spent:
            raise Spent
        if self._last is None or not np.array_equal(self.seen[-1][0], x):
            size = len(x)
            moves = np.vstack([np.zeros(size), STEP * np.eye(size), -STEP * np.eye(size)])
            values = self.goals(x + moves)
            self.aims = values.shape[1]
            if self.limits is not None:
                values = np.concatenate([values, self.limits(x + moves)], axis=1)
            slopes = (values[1 : size + 1] - values[size + 1 :]) / (2 * STEP)
            self._last = (values[0], slopes.T)
            self.seen.append((x.copy(), float(values[0].min())))
        return self._last

    @property
    def best(self) -> Floats:
        """Coordinates seen so far whose smallest value is largest."""
        return max(self.seen, key=lambda each: each[1])[0]


def maximise(
    problem: Problem, start: Floats, limits: Functions, free: Functions | None = None, most_rounds: int = 80
) -> Floats:
    """Maximise the smallest of some functions of the gains, from a start; all gains in SI.

    ``limits`` and ``free``: (candidates, coordinates) -> (candidates, functions). Without ``free`` the
    smallest limit is made as large as can be, up to the reserve of 30 %; with it the limits are constraints,
    and the smallest of ``free`` is maximised.
    """
    program = Program(problem, limits) if free is None else Program(problem, free, limits)
    most = RESERVE if free is None else None
    low, high = problem.coordinates(problem.lower), problem.coordinates(problem.upper)
    x0, rules = np.clip(problem.coordinates(start), low, high), problem.coordinates(problem.start)
    if problem.spent:
        return problem.values(x0)
    values = program.model(x0)[0]
    first, raised = float(values[: program.aims].min()), np.arange(len(values)) < program.aims
    met = {  # goals less t, then limits, of y = [coordinates, t]
        "type": "ineq",
        "fun": lambda y: program.model(y[:-1])[0] - np.where(raised, y[-1], 0.0),
        "jac": lambda y: np.column_stack([program.model(y[:-1])[1], np.where(raised, -1.0, 0.0)]),
    }
    try:
        result = minimize(
            lambda y: float(TIE * np.sum((y[:-1] - rules) ** 2) - y[-1]),
            np.append(x0, first if most is None else min(first, most)),
            jac=lambda y: np.append(2 * TIE * (y[:-1] - rules), -1.0),
            method="SLSQP", bounds=[*zip(low, high, strict=True), (None, most)],
            constraints=met, options={"maxiter": most_rounds, "ftol": 1e-9},
        ).x[:-1]  # fmt: skip
    except Spent:
        result = program.best
    return problem.values(np.clip(result, low, high))


POINTS = 6
_SPAN = (0.6, 1.6)
_MET = -1e-3


def trade_off(
    problem: Problem, gains: Floats, working: Floats, tell: Callable[[int], None]
) -> tuple[TradeOffPoint, ...]:
    """Largest smallest phase margin (all loops, ``working`` corners) at bandwidths about the tuned one.

    Of the outermost loop; ``tell`` is called with how many of the `POINTS` bandwidths are done.
    """
    outer = problem.design.controller.outermost
    others = [
        k for k, r in enumerate(problem.requirements)
        if r.quantity != "phase_margin" and not (r.quantity == "bandwidth" and r.loop in (outer, None))
    ]  # fmt: skip
    trade = _TradeOff(problem, working, others)
    centre = float(np.min(trade.width(gains[None, :])))
    if not np.isfinite(centre):
        return ()
    targets = [float(hz) for hz in centre * np.geomspace(*_SPAN, POINTS)]
    result: list[Floats] = []
    for wanted in targets:
        starts = [gains, *result[-1:]]
        tried = [trade.best(start, wanted) for start in starts]
        result.append(trade.better([*starts, *tried], wanted))
        tell(len(result))
    for k in range(len(targets) - 2, -1, -1):  # what a higher bandwidth allows, a lower one does too
        result[k] = trade.better(result[k : k + 2], targets[k])
    points = (trade.point(one[None, :]) for one in result)
    return tuple(point for point in points if np.isfinite(point.bandwidth_hz))


@dataclass(frozen=True)
class _TradeOff:
    """Bandwidth, phase margins and the ``others`` of the requirements at some corners, of rows of gains."""

    problem: Problem
    working: Floats
    others: list[int]

    def width(self, rows: Floats) -> Floats:
        return self.problem.figure("bandwidth", self.problem.design.controller.outermost, rows, self.working)

    def margins(self, rows: Floats) -> Floats:
        """Phase margins, shape (candidates, loops * corners); 180 without crossing."""
        loops = loops_of(self.problem.design)
        result = [self.problem.figure("phase_margin", loop, rows, self.working) for loop in loops]
        return np.clip(np.concatenate(result, axis=1), -180.0, 180.0)

    def kept(self, rows: Floats, wanted_hz: float) -> list[Floats]:
        """How far bandwidth, and the other figures, are from their limits, each (candidates, distances)."""
        width = self.width(rows)
        made = [np.where(np.isnan(width), -3.0, width / wanted_hz - 1.0)]
        if self.others:
            made.append(self.problem.distances(rows, self.working)[:, :, self.others].reshape(len(rows), -1))
        return made

    def better(self, candidates: list[Floats], wanted_hz: float) -> Floats:
        """Of some gains those with the largest phase margin that keep the bandwidth and the other limits."""
        rows = np.array(candidates)
        margin = self.margins(rows).min(axis=1)
        short = sum(np.minimum(part.min(axis=1) - _MET, 0.0) for part in self.kept(rows, wanted_hz))
        return rows[int(np.lexsort((-margin, -np.asarray(short)))[0])]

    def best(self, start: Floats, wanted_hz: float) -> Floats:
        """Largest phase margin at a bandwidth or above, other requirements kept."""

        def limits(x: Floats) -> Floats:
            return np.concatenate(self.kept(self.problem.values(x), wanted_hz), axis=1)

        def free(x: Floats) -> Floats:
            return self.margins(self.problem.values(x)) / 45.0

        return maximise(self.problem, start, limits, free, most_rounds=30)

    def point(self, row: Floats) -> TradeOffPoint:
        width, margin = float(np.min(self.width(row))), float(self.margins(row).min())
        kept = self.problem.distances(row, self.working)[0][:, self.others]
        return TradeOffPoint(width, margin, bool(kept.size == 0 or kept.min() >= _MET))
