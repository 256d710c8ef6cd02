"""The values of a design with which its loop has a measured response: least squares, and profiles of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import stdtrit

from actuator_lti.design import parameter_value
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.systems.root import root
from actuator_lti.types import Floats, Progress
from analyses.estimation.fit import COVERAGE, Fit, Fixed
from analyses.estimation.least_squares import RESOLVED, identifiable
from analyses.identification.response_model import Seen
from analyses.identification.response_search import Point, Search
from analyses.records.finding import SURE

UNKNOWN = "not determined, the design's value kept"
STARTS: tuple[float, ...] = 1.0, 0.25, 4.0
"""Stiffnesses to begin with, over the design's: an octave of the resonance to either side."""
REACH = 30.0
"""Factor: a value is not told where as much more, or of an inertia or stiffness less, explains as well."""
ROUGH = 1e-3  # part of what is left that another step of a rough fit has to be expected to save
FAR = 10.0  # levels by which a point to begin with may be off; another is tried nearer
CLOSE = 0.01  # part of its level that an end of an interval is found to


class _Lower(Exception):
    """A profile has met a better fit, at these coordinates, than the one that it is of."""


@dataclass(frozen=True)
class _Side:
    """Points of a profile to one side of a fit: a coordinate held off by some distance, the others fitted."""

    search: Search
    best: Point
    k: int
    level: float
    side: float  # -1 or 1
    most: float  # how far is looked
    bound: float  # the end of the interval where the deviation is below its level there

    def further(self, near: Point, distance: float) -> Point:
        """A point by so much beyond another, the others as a straight response would have them there."""
        return self.search.at(near.x + distance * self.side * near.along(self.k))

    def fitted(self, begin: Point) -> Point:
        """The others fitted again; what is left is without bound where what fits better grows."""
        there = self.search.least(begin, enough=ROUGH, hold=self.k)
        if not there.cost < self.best.cost - CLOSE * self.level**2:
            return there
        if self.search.rank(there) > self.search.rank(self.best):
            return replace(there, rest=np.full_like(there.rest, np.inf))
        raise _Lower(there.x)

    def off(self, there: Point) -> float:
        """The deviation over its level."""
        return float(np.sqrt(max(there.cost - self.best.cost, 0.0))) / self.level

    def untold(self) -> bool:
        """Whether values as far as is looked explain the response as well."""
        return self.off(self.fitted(self.further(self.best, self.most))) < 1.0

    def end(self, guess: float) -> float:
        """How far the end of the interval is: the first that is met on the way out."""
        path, at = {0.0: self.best}, min(guess, self.most)
        while at > (low := max(path)):
            begin = self.further(path[low], at - low)
            near = begin.cost < self.best.cost + (FAR * self.level) ** 2
            if not near and at - low > CLOSE * at:
                at = 0.5 * (low + at)
                continue
            path[at] = self.fitted(begin)
            if self.off(path[at]) > 1.0 - CLOSE:
                break
            if at == self.most:
                return self.bound
            at = min(2.0 * at, self.most)

        def beyond(at: float) -> float:
            if at not in path:  # the others begin as they are at the point that is nearest
                near = min(path, key=lambda one: abs(one - at))
                path[at] = self.fitted(self.further(path[near], at - near))
            off = self.off(path[at]) - 1.0
            return 0.0 if abs(off) < CLOSE else off

        return root(beyond, low, at, CLOSE * at) if at else 0.0


def _interval(search: Search, best: Point, k: int, level: float, ranged: bool) -> Floats:
    """Both ends of the interval of one coordinate, from it; infinite where it has none.

    There the deviation is ``level``, all others fitted again (Bates and Watts, Nonlinear Regression Analysis,
    1988, 6.1). ``ranged``: a factor `REACH` is as far as none. What a straight response would not tell is
    looked at there first, and where one end is not there the other is not looked for.
    """
    guess, sides = level * float(np.sqrt(best.covariance[k, k])), list[_Side]()
    for side, edge in zip((-1.0, 1.0), search.box[:, k], strict=True):
        room = float(abs(edge - best.x[k]))
        most = min(room, float(np.log(REACH)) if ranged else REACH * max(abs(best.x[k]), 1.0))
        bound = room if most == room and not ranged else np.inf
        sides.append(_Side(search, best, k, level, side, most, bound))
    untold = [guess >= one.most and np.isinf(one.bound) and one.untold() for one in sides]
    ends = np.where(untold, np.inf, 0.0) if any(untold) else np.array([one.end(guess) for one in sides])
    return np.array([-1.0, 1.0]) * ends


@dataclass(frozen=True, kw_only=True)
class ResponseFit(Fit):
    """Values by key with which a loop's response is the measured one.

    Errors are widened by a misfit above 1; without deviations they are those of the residual, with Student's
    factor at its degrees of freedom. 1.96 standard errors reach the farther end of an interval.
    """

    misfit: float | None  # root of the mean squared residual over its deviation; None: none was measured
    at_bound: tuple[str, ...]
    also: Mapping[str, float]  # other values, beyond the intervals, that explain the response as well
    ends: Floats = field(repr=False)  # 95 % intervals by profiles, (p, 2), with the error of what is kept
    joint: Floats = field(repr=False)  # covariance with that error; ``covariance``: at what is kept
    rest: Floats = field(repr=False)  # what is left, in its deviations
    slopes: Floats = field(repr=False)  # of that, over the values

    def interval(self, name: str) -> tuple[float, float]:
        """95 % interval of one value, longer to the side where the response tells it less."""
        low, high = self.ends[self.names.index(name)].tolist()
        return low, high


def determined(start: Design, names: tuple[str, ...], seen: Seen, progress: Progress = None) -> ResponseFit:
    """The fit of what is determined; of the others the one told worst is kept first."""
    left, better = dict[str, str](), list[Floats]()
    while mine := tuple(name for name in names if name not in left):
        if progress is not None:
            progress(len(left), len(names))
        n, kept = len(mine), tuple(key for key in left if parameter_value(start, key))
        search, rough = (Search.of(start, mine, one, seen.grows) for one in (seen.off, seen.ratio))
        best, *others = _fits(search, rough, [x[:n] for x in better], start.controller.period_s)
        freedom = len(best.rest) - n
        variance = best.cost / freedom
        unit = float(np.sqrt(max(variance, 1.0) if seen.known else variance))
        level = COVERAGE if seen.known else float(stdtrit(freedom, 0.975))
        beside = Search.of(start, mine, seen.off, seen.grows, kept, unit)
        begins = [np.append(best.x, np.zeros(len(kept))), *better]
        joint = min((beside.least(beside.at(x)) for x in begins), key=beside.rank)
        try:
            ends, untold = _asked(start, beside, joint, level)
        except _Lower as lower:
            better.append(lower.args[0])
            continue
        if not untold:
            fit = _determined(search, [best, *others], beside, joint, ends, level)
            own = {key: parameter_value(start, key) for key in left}
            fixed = {key: Fixed(value=own[key], reason=f"{why}: {UNKNOWN}") for key, why in left.items()}
            return replace(fit, fixed=fixed, misfit=float(np.sqrt(variance)) if seen.known else None)
        left, better = left | untold, []
    raise InputError(f"the response determines nothing of {', '.join(left)}", where=start.name)


def _fits(search: Search, rough: Search, more: Sequence[Floats], tick_s: float) -> list[Point]:
    """Fits from several stiffnesses, of the response's logarithm first, and from more; the best one first.

    Over the computing delay the response has a kink at each whole tick, which a search does not pass: from
    the middle of the ticks beside the best one it begins again.
    """
    spring = np.array([name == "coupling.stiffness" for name in search.names])
    begin = np.where(search.logs, 0.0, 1.0)
    starts = [begin + np.log(factor) * spring for factor in (STARTS if spring.any() else STARTS[:1])]
    ended = [rough.least(rough.at(x), enough=ROUGH) for x in starts]
    least = min(one.cost for one in ended)
    good = [one.x for one in ended if one.cost <= 2.0 * least]
    fits = sorted((search.least(search.at(x)) for x in (*good, *more)), key=search.rank)
    late, tried = np.array([name == "control.computing_delay" for name in search.names]), set[int]()
    while late.any() and (tick := int(search.values(fits[0].x)[late][0] / tick_s)) not in tried:
        tried.add(tick)
        beside = [(one + 0.5) * tick_s / search.turn[late, late] for one in (tick - 1, tick + 1)]
        begins = [np.where(late, at, fits[0].x) for at in beside if at > 0.0]
        fits = sorted([*fits, *(search.least(search.at(x)) for x in begins)], key=search.rank)
    return fits


def _asked(start: Design, search: Search, joint: Point, level: float) -> tuple[Floats, dict[str, str]]:
    """The ends of all intervals in coordinates, shape (p, 2), or the worst that is not told, and why.

    An inertia beside another that is looked for, and a stiffness, are told where their interval has two ends,
    another value where its standard error is below the design's value, or a quarter of what it is off; a
    delay too whose interval is within a tick: by what it is off noise would decide which delays are told.
    """
    n, ends = search.count, np.zeros((search.count, 2))
    names, x = search.names[:n], joint.x[:n]
    gone = np.argsort(np.abs(x) > np.where(search.logs[:n], np.log(REACH), REACH), kind="stable")
    _, like = identifiable(joint.slopes[:, gone], [names[k] for k in gone], least=RESOLVED)
    if like:  # the last one: of those at the end of a valley, where others do the same
        return ends, {like[-1].name: str(like[-1])}
    std = np.sqrt(np.diag(joint.covariance))[:n]
    own = np.array([parameter_value(start, name) for name in names])
    off = np.abs(search.values(joint.x)[:n] - own)
    tick = np.where(np.array(names) == "control.computing_delay", start.controller.period_s, 1e-300)
    share = std * search.sizes(joint.x) / np.max([np.abs(own), off / SURE, tick / level], axis=0)
    inertia = np.char.endswith(names, "inertia")
    ranged = search.logs[:n] & ~(inertia & (inertia.sum() == 1))
    share[ranged] = level * std[ranged] / np.log(REACH)
    order = sorted(range(n), key=lambda k: (not (ranged[k] or share[k] > 1.0), -share[k]))
    for k in order:
        if not ranged[k] and share[k] > 1.0:
            return ends, {names[k]: "its standard error is larger than the design's value"}
        ends[k] = joint.x[k] + _interval(search, joint, k, level, bool(ranged[k]))
        if np.isinf(ends[k]).any():
            much = f"{REACH:g} times as much" if np.isinf(ends[k, 1]) else f"a {REACH:g}th of it"
            return ends, {names[k]: f"{much} explains the response as well"}
    return ends, {}


def _determined(
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
    also = [search.values(one.x) for one in others if search.rank(one) <= (search.rank(best)[0], most)]
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
