"""The values of a design with which its loop has a measured response: least squares, and profiles of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.special import stdtrit

from actuator_lti.design import parameter_value
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.estimation.fit import COVERAGE, Fit, Fixed
from analyses.estimation.least_squares import told_apart
from analyses.estimation.parameters import own_share
from analyses.identification.output_error import box_of
from analyses.identification.response_model import Seen, Values
from analyses.records.consistency import SURE
from analyses.studies.sampling import correlation_of

NOT_TOLD = "not determined, the design's value kept"
INERTIAS = "motor.rotor_inertia", "load.inertia"
NEVER_ZERO = (*INERTIAS, "coupling.stiffness")
"""Above 0: their logarithms are looked for."""
RESOLVED = 1e-5
"""Share of a slope that is its own: below it two values do the same."""
STEP = 1e-5
"""Share of a value for its differences: those of a sharp resonance curve at 1e-3 already."""
LEAST_STEPPED = 0.1
"""Part of the design's value below which a value's own size is no measure of its step."""
STARTS: tuple[float, ...] = 1.0, 0.25, 4.0
"""Stiffnesses to begin with, over the design's: an octave of the resonance to either side."""
REACH = 30.0
"""Factor: a value is not told where as much more, or of an inertia or stiffness less, explains as well."""
FURTHEST = 1e6
"""Factor of the design's inertia or stiffness at which a search ends."""
MOST_TICKS = 100.0
"""Of computing delay: a design has no more."""
ROUGH, FINE, CRAWL = 1e-3, 1e-6, 1e-4
"""Parts of what is left that a step has to be expected to save in a rough fit and a fine one, and to save."""
ROUNDS = 100
"""Steps of a fit, and of the search of an end."""
MOST_DAMPED = 1e10
BEND = 0.1
"""Part of a step after which the bend of the response along it is looked at."""
FAR = 10.0
"""Levels by which a point to begin with may be off, and another is tried nearer."""
CLOSE = 0.01
"""Part of its level that an end of an interval is found to."""


@dataclass(frozen=True)
class Point:
    """Coordinates, shape (p,), what the response is off by there in its deviations, and slopes of that."""

    x: Floats
    rest: Floats
    slopes: Floats

    @cached_property
    def cost(self) -> float:
        """Sum of squares."""
        return float(self.rest @ self.rest)

    @cached_property
    def covariance(self) -> Floats:
        """Of the coordinates, as if the response were straight in them; of a QR factor, so never below 0."""
        size = np.linalg.norm(self.slopes, axis=0)
        spread = np.linalg.inv(np.linalg.qr(self.slopes / size, mode="r")) / size[:, None]
        return np.asarray(spread @ spread.T)


class _Lower(Exception):
    """A profile has met a better fit, at these coordinates, than the one that it is of."""


@dataclass(frozen=True, kw_only=True)
class Search:
    """Coordinates of the first ``count`` values, which are looked for, and of others that are kept.

    ``origin + turn y``, y the exponential of a coordinate where it is a logarithm (``logs``): that of an
    inertia or a stiffness over the design's. What is kept has independent deviations of the design's own
    error, which weigh as measured. ``box`` holds the coordinates, ``ends`` the values, each of shape (2, p).
    ``unit``: deviation of what is left of the response.
    """

    residual: Callable[[Values], Floats]
    names: tuple[str, ...]
    count: int
    logs: NDArray[np.bool_]
    origin: Floats
    turn: Floats
    box: Floats
    ends: Floats
    unit: float

    @classmethod
    def of(
        cls,
        start: Design,
        names: tuple[str, ...],
        residual: Callable[[Values], Floats],
        kept: tuple[str, ...] = (),
        unit: float = 1.0,
    ) -> Search:
        """The search of some values beside others, within what their keys allow."""
        every, n = np.array((*names, *kept)), len(names)
        scale, ends = box_of(start, (*names, *kept))
        ends[1, every == "control.computing_delay"] = MOST_TICKS * start.controller.period_s
        own = np.array([parameter_value(start, key) for key in kept])
        std = own * [own_share(start, key) for key in kept]
        size, turn = np.linalg.eigh(np.outer(std, std) * correlation_of(start, kept))
        logs = np.isin(every, NEVER_ZERO) & (np.arange(len(every)) < n)
        box = np.where(logs, np.log(np.clip(ends / scale, 1.0 / FURTHEST, FURTHEST)), ends / scale)
        box[:, n:] = [[-np.inf], [np.inf]]
        return cls(
            residual=residual,
            names=(*names, *kept),
            count=n,
            logs=logs,
            origin=np.append(np.zeros(n), own),
            turn=block_diag(np.diag(scale[:n]), turn * np.sqrt(np.maximum(size, 0.0))),
            box=box,
            ends=ends,
            unit=unit,
        )

    def values(self, x: Floats) -> Floats:
        """Values of coordinates, shape (..., p)."""
        straight = np.where(self.logs, np.exp(np.where(self.logs, x, 0.0)), x)
        return np.clip(self.origin + straight @ self.turn.T, *self.ends)

    def sizes(self, x: Floats) -> Floats:
        """By how much a value that is looked for changes with its coordinate, shape (count,)."""
        size = np.where(self.logs, np.exp(np.where(self.logs, x, 0.0)), 1.0) * np.diag(self.turn)
        return np.asarray(size[: self.count])

    def off(self, x: Floats) -> Floats:
        """What is left at coordinates of shape (K, p), beside it the deviations of what is kept."""
        values = dict(zip(self.names, self.values(x).T, strict=True))
        return np.hstack([self.residual(values) / self.unit, x[:, self.count :]])

    def at(self, x: Floats) -> Point:
        """What is left at coordinates, held in the box, and its slopes by central differences."""
        x = np.clip(x, *self.box)
        straight = ~self.logs & (np.arange(len(x)) < self.count)
        step = STEP * np.diag(np.where(straight, np.maximum(np.abs(x), LEAST_STEPPED), 1.0))
        up, down = (np.clip(x + side * step, *self.box) for side in (1.0, -1.0))
        here, *moved = self.off(np.vstack([x, up, down]))
        change = np.subtract(*np.split(np.array(moved), 2))
        return Point(x, here, (change / np.diag(up - down)[:, None]).T)

    def least(
        self, begin: Point, *, enough: float = FINE, hold: int | None = None, goal: float = 0.0
    ) -> Point:
        """The least sum of squares near a point, in the box, one coordinate of which may be held.

        Levenberg and Marquardt's steps, bent as the response is along them (Transtrum and Sethna,
        arXiv:1201.5885). It ends below a ``goal``, or where a step would save less than a part ``enough`` of
        what is left: the values are off by as little of their errors (Bates and Watts, Technometrics 23,
        1981).
        """
        here, damp, size = begin, 1e-3, np.zeros(len(begin.x))
        for _ in range(ROUNDS):
            downhill = -here.slopes.T @ here.rest
            free = np.where(downhill > 0.0, here.x < self.box[1], here.x > self.box[0]) & (downhill != 0.0)
            free[[] if hold is None else hold] = False
            size = np.maximum(size, np.linalg.norm(here.slopes, axis=0))
            slopes = here.slopes[:, free] / size[free]
            saved = float(np.sum((np.linalg.qr(slopes)[0].T @ here.rest) ** 2))
            while here.cost > goal and saved > enough * (here.cost - saved) and damp < MOST_DAMPED:
                there = self.at(here.x + self._step(here, slopes, size, free, damp))
                if there.cost < here.cost and np.isfinite(there.slopes).all():
                    break
                damp *= 10.0
            else:
                return here
            saved, here, damp = here.cost - there.cost, there, 0.1 * damp
            if saved < max(enough, CRAWL) * here.cost:
                break
        return here

    def _step(
        self, here: Point, slopes: Floats, size: Floats, free: NDArray[np.bool_], damp: float
    ) -> Floats:
        """One step of the free coordinates, whose slopes are over their sizes."""
        table = np.vstack([slopes, np.sqrt(damp) * np.eye(slopes.shape[1])])
        solve = np.linalg.pinv(table)[:, : len(here.rest)]
        step, bend = np.zeros(len(size)), np.zeros(len(size))
        step[free] = -solve @ here.rest / size[free]
        moved = self.off(np.clip(here.x + BEND * step, *self.box)[None])[0]
        bend[free] = -solve @ (moved - here.rest - BEND * here.slopes @ step) / BEND**2 / size[free]
        bent = np.linalg.norm(bend * size) < 0.4 * np.linalg.norm(step * size)  # else no series in it
        return step + bend if bent else step


@dataclass(frozen=True)
class _Side:
    """Points of a profile to one side of a fit: a coordinate held off by some distance, the others fitted.

    ``straight``: coordinates over that distance, of a straight response. ``most``: how far is looked; where
    the deviation is below its ``level`` there, the end of the interval is ``bound``.
    """

    search: Search
    best: Point
    k: int
    level: float
    straight: Floats
    most: float
    bound: float

    def fitted(self, begin: Point, at: float) -> tuple[Floats, float]:
        """The others fitted again, and the deviation over its level; at the farthest only which is more."""
        goal = self.best.cost + self.level**2 if at == self.most else 0.0
        there = self.search.least(begin, enough=ROUGH, hold=self.k, goal=goal)
        if there.cost < self.best.cost - CLOSE * self.level**2:
            raise _Lower(there.x)
        return there.x, float(np.sqrt(max(there.cost - self.best.cost, 0.0))) / self.level

    def untold(self) -> bool:
        """Whether values as far as is looked explain the response as well."""
        return self.fitted(self.search.at(self.best.x + self.most * self.straight), self.most)[1] < 1.0

    def end(self, guess: float) -> float:
        """How far the end of the interval is."""
        path = [(0.0, self.best.x), (1.0, self.best.x + self.straight)]
        low, high, at = (0.0, 0.0), (np.inf, np.inf), min(guess, self.most)
        for _ in range(ROUNDS if at > 0.0 else 0):
            begin = self.search.at(_along(path, at))
            while begin.cost > self.best.cost + (FAR * self.level) ** 2 and at - low[0] > CLOSE * at:
                at = 0.5 * (low[0] + at)
                begin = self.search.at(_along(path, at))
            x, share = self.fitted(begin, at)
            if share < 1.0 and at == self.most:
                return self.bound
            if abs(share - 1.0) < CLOSE or high[0] - low[0] < CLOSE * at:
                break
            path = sorted([(at, x), *path], key=lambda one: abs(one[0] - at))[:3]
            low, high = ((at, share), high) if share < 1.0 else (low, (at, share))
            part = (1.0 - low[1]) / (high[1] - low[1])
            inside = low[0] + float(np.clip(part, 0.1, 0.9)) * (high[0] - low[0])
            at = inside if np.isfinite(high[0]) else min(at * min(1.01 / max(share, 0.25), 4.0), self.most)
        return at


def _interval(search: Search, best: Point, k: int, level: float, ranged: bool) -> Floats:
    """Both ends of the interval of one coordinate, from it; infinite where it has none.

    There the deviation is ``level``, all others fitted again (Bates and Watts, Nonlinear Regression Analysis,
    1988, 6.1). ``ranged``: a factor `REACH` is as far as none. What a straight response would not tell is
    looked at there first, and where one end is not there the other is not looked for.
    """
    variance, sides = float(best.covariance[k, k]), list[_Side]()
    guess = level * float(np.sqrt(variance))
    for side, edge in zip((-1.0, 1.0), search.box[:, k], strict=True):
        room = float(abs(edge - best.x[k]))
        most = min(room, float(np.log(REACH)) if ranged else REACH * max(abs(best.x[k]), 1.0))
        bound = room if most == room and not ranged else np.inf
        sides.append(_Side(search, best, k, level, side * best.covariance[k] / variance, most, bound))
    untold = [guess >= one.most and np.isinf(one.bound) and one.untold() for one in sides]
    ends = (
        [np.inf * far if far else 0.0 for far in untold] if any(untold) else [one.end(guess) for one in sides]
    )
    return np.array([-1.0, 1.0]) * ends


def _along(path: Sequence[tuple[float, Floats]], at: float) -> Floats:
    """The polynomial through the points of a path."""
    weights = [np.prod([(at - t) / (own - t) for t, _ in path if t != own]) for own, _ in path]
    return np.asarray(weights) @ np.array([x for _, x in path])


@dataclass(frozen=True, kw_only=True)
class ResponseFit(Fit):
    """Values by key with which a loop's response is the measured one.

    ``misfit`` is the root of the mean squared residual over its deviation, None where none was measured.
    Errors are widened by a misfit above 1; without deviations they are those of the residual, with Student's
    factor at its degrees of freedom. ``ends`` are 95 % intervals by profiles, shape (p, 2), with the error of
    what is kept; 1.96 standard errors reach their farther end. ``also`` are other values, beyond these, that
    explain the response as well. ``covariance``: at what is kept; ``joint``: with the error of that.
    ``slopes`` of what is left (``rest``, in its deviations), over the values.
    """

    misfit: float | None
    at_bound: tuple[str, ...]
    also: Mapping[str, float]
    ends: Floats = field(repr=False)
    joint: Floats = field(repr=False)
    rest: Floats = field(repr=False)
    slopes: Floats = field(repr=False)

    def interval(self, name: str) -> tuple[float, float]:
        """95 % interval of one value, longer to the side where the response tells it less."""
        low, high = self.ends[self.names.index(name)].tolist()
        return low, high


def determined(
    start: Design, names: tuple[str, ...], seen: Seen, progress: Callable[[int, int], None] | None
) -> ResponseFit:
    """The fit of what is determined; of the others the one told worst is kept first."""
    left, better = dict[str, str](), list[Floats]()
    while mine := tuple(name for name in names if name not in left):
        if progress is not None:
            progress(len(left), len(names))
        search = Search.of(start, mine, seen.off)
        fits = _fits(search, Search.of(start, mine, seen.ratio), better)
        best, better = fits[0], []
        freedom = len(best.rest) - len(mine)
        variance = best.cost / freedom
        unit = float(np.sqrt(max(variance, 1.0) if seen.known else variance))
        level = COVERAGE if seen.known else float(stdtrit(freedom, 0.975))
        beside = Search.of(
            start, mine, seen.off, tuple(key for key in left if parameter_value(start, key)), unit
        )
        joint = beside.least(beside.at(np.append(best.x, np.zeros(len(beside.names) - len(mine)))))
        like = [told_apart(one.slopes[:, : len(mine)], mine, least=RESOLVED)[1] for one in (best, joint)]
        if untold := {one.name: str(one) for one in (*like[0], *like[1])}:
            left |= untold
            continue
        try:
            ends, untold = _asked(start, beside, joint, level)
        except _Lower as lower:
            better = [lower.args[0][: len(mine)]]
            continue
        if not untold:
            fit = _told(search, fits, beside, joint, ends, level)
            own = {key: parameter_value(start, key) for key in left}
            fixed = {key: Fixed(value=own[key], reason=f"{why}: {NOT_TOLD}") for key, why in left.items()}
            return replace(fit, fixed=fixed, misfit=np.sqrt(variance) if seen.known else None)
        left |= untold
    raise InputError(f"the response determines nothing of {', '.join(left)}", where=start.name)


def _fits(search: Search, rough: Search, more: Sequence[Floats]) -> list[Point]:
    """Fits from several stiffnesses, of the response's logarithm first, and from more; the best one first."""
    spring = np.array([name == "coupling.stiffness" for name in search.names])
    begin = np.where(search.logs, 0.0, 1.0)
    starts = [begin + np.log(factor) * spring for factor in (STARTS if spring.any() else STARTS[:1])]
    ended = [rough.least(rough.at(x), enough=ROUGH) for x in starts]
    least = min(one.cost for one in ended)
    good = [one.x for one in ended if one.cost <= 2.0 * least]
    return sorted((search.least(search.at(x)) for x in (*good, *more)), key=lambda one: one.cost)


def _asked(start: Design, search: Search, joint: Point, level: float) -> tuple[Floats, dict[str, str]]:
    """The ends of all intervals in coordinates, shape (p, 2), or the worst that is not told, and why.

    An inertia beside another that is looked for, and a stiffness, are told where their interval has two ends,
    another value where its standard error is below the design's value, or a quarter of what it is off.
    """
    n = search.count
    names, std = search.names[:n], np.sqrt(np.diag(joint.covariance))[:n]
    own = np.array([parameter_value(start, name) for name in names])
    off = np.abs(search.values(joint.x)[:n] - own)
    share = std * search.sizes(joint.x) / np.maximum(np.maximum(np.abs(own), off / SURE), 1e-300)
    ranged = search.logs[:n] & ~(np.isin(names, INERTIAS) & (np.isin(names, INERTIAS).sum() == 1))
    share[ranged] = level * std[ranged] / np.log(REACH)
    order = sorted(range(n), key=lambda k: (not (ranged[k] or share[k] > 1.0), -share[k]))
    ends = np.zeros((n, 2))
    for k in order:
        if not ranged[k] and share[k] > 1.0:
            return ends, {names[k]: "its standard error is larger than the design's value"}
        ends[k] = joint.x[k] + _interval(search, joint, k, level, bool(ranged[k]))
        if np.isinf(ends[k]).any():
            much = f"{REACH:g} times as much" if np.isinf(ends[k, 1]) else f"a {REACH:g}th of it"
            return ends, {names[k]: f"{much} explains the response as well"}
    return ends, {}


def _told(
    search: Search, fits: Sequence[Point], beside: Search, joint: Point, ends: Floats, level: float
) -> ResponseFit:
    """What is told, in values, of the fits at what is kept, and of the one beside it."""
    (best, *others), n = fits, search.count
    values, size = search.values(best.x), search.sizes(best.x)
    far = np.tile(joint.x, (2, 1))
    far[:, :n] = ends.T
    lower, upper = beside.values(far)[:, :n]
    ends = np.column_stack([np.minimum(lower, values), np.maximum(upper, values)])
    wide = np.abs(ends - values[:, None]).max(axis=1) / COVERAGE / np.sqrt(np.diag(joint.covariance)[:n])
    gained = np.linalg.qr(best.slopes)[0].T @ best.rest / beside.unit  # by leaving the box
    ended = np.any(best.x == search.box, axis=0) & (search.logs | (gained @ gained > level**2))
    most = best.cost + (level * beside.unit) ** 2
    also = [search.values(one.x) for one in others if one.cost <= most]
    also = [one for one in also if np.any((one < ends[:, 0]) | (one > ends[:, 1]))]
    return ResponseFit(
        names=search.names,
        values=values,
        covariance=beside.unit**2 * best.covariance * np.outer(wide, wide),
        misfit=None,
        at_bound=tuple(np.array(search.names)[ended].tolist()),
        also=dict(zip(search.names, also[0].tolist(), strict=True)) if also else {},
        ends=ends,
        joint=joint.covariance[:n, :n] * np.outer(wide, wide),
        rest=best.rest,
        slopes=best.slopes / size,
    )
