"""First and last passages and the largest value of a response, by branch and bound over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_lti.errors import NumericalError
from actuator_lti.margins.loop import Mask, Real
from actuator_lti.step_terms import Exponentials

_PARTS = 4
_MOST = 3_000_000  # values looked at
_NARROW = 2e-14
_FLAT = 1e-12
BAND = (0.98, 1.02)


@dataclass(frozen=True)
class _Intervals:
    a: Real
    b: Real
    at_a: Real
    at_b: Real

    def kept(self, keep: Mask) -> _Intervals:
        return _Intervals(self.a[keep], self.b[keep], self.at_a[keep], self.at_b[keep])


class Search:
    """Search of a response from ``start`` on.

    Between two times a and b a function differs from the chord by (b - a)^2/8 max |y''| at most: with the
    bounds of `Exponentials` an interval is either settled as a whole or split.

    Parameters
    ----------
    response : Exponentials
    start : float
        First time (or sample) looked at.
    whole : bool
        Only whole numbers are times: a sampled response.
    """

    def __init__(self, response: Exponentials, start: float, whole: bool) -> None:
        self._y, self._start, self._whole = response, start, whole

    def first_at_least(self, level: float) -> float:
        """First time at which the response reaches a level below 1."""
        best = np.inf
        intervals = self._initial(0.5 * (1.0 - level))
        budget = _MOST
        while intervals.a.size:
            for t, y in ((intervals.a, intervals.at_a), (intervals.b, intervals.at_b)):
                best = min(best, float(t[y >= level].min(initial=np.inf)))
            upper = self._upper(intervals)
            intervals = intervals.kept((intervals.a < best) & (upper >= level) & (intervals.at_a < level))
            intervals, budget = self._split(intervals, budget)
        return best

    def last_outside(self) -> float | None:
        """Last time at which the response is outside of the band; ``None``: never from the start on."""
        best = -np.inf
        intervals = self._initial(BAND[1] - 1.0)
        budget = _MOST
        while intervals.a.size:
            for t, y in ((intervals.a, intervals.at_a), (intervals.b, intervals.at_b)):
                best = max(best, float(t[outside(y)].max(initial=-np.inf)))
            variation, curvature = self._bounds(intervals)
            chord = np.maximum(np.abs(intervals.at_a - 1.0), np.abs(intervals.at_b - 1.0)) + curvature
            open_question = np.minimum(variation, chord) > BAND[1] - 1.0
            intervals = intervals.kept((intervals.b > best) & open_question & ~outside(intervals.at_b))
            intervals, budget = self._split(intervals, budget)
        return best if np.isfinite(best) else None

    def greatest(self, least: float) -> tuple[float, float]:
        """Largest value above ``least`` and its time; ``(least, inf)`` where there is none."""
        best, place = least, np.inf
        intervals = self._initial(max(least - 1.0, 1e-9))
        budget = _MOST
        while intervals.a.size:
            for t, y in ((intervals.a, intervals.at_a), (intervals.b, intervals.at_b)):
                k = int(y.argmax())
                if y[k] > best or (y[k] == best and t[k] < place):
                    best, place = float(y[k]), float(t[k])
            intervals = intervals.kept(self._upper(intervals) > best + _FLAT * max(abs(best), 1.0))
            intervals, budget = self._split(intervals, budget)
        return best, place

    def _bounds(self, intervals: _Intervals) -> tuple[Real, Real]:
        variation, second = self._y.bounds(intervals.a, intervals.b)
        return variation, 0.125 * (intervals.b - intervals.a) ** 2 * second

    def _upper(self, intervals: _Intervals) -> Real:
        variation, curvature = self._bounds(intervals)
        return np.minimum(1.0 + variation, np.maximum(intervals.at_a, intervals.at_b) + curvature)

    def _initial(self, level: float) -> _Intervals:
        end = self._y.horizon(level, self._start)
        early = 0.1 / self._y.fastest
        count = int(np.ceil(np.log2(max((end - self._start) / early, 2.0)))) + 1
        edges = self._start + (end - self._start) * 0.5 ** np.arange(count, -1.0, -1.0)
        edges = np.concatenate(([self._start], edges))
        if self._whole:
            edges = np.ceil(edges)
        edges = np.unique(edges)
        if edges.size < 2:
            edges = np.array([edges[0], edges[0] + 1.0])
        y = self._y.values(edges)
        return _Intervals(edges[:-1], edges[1:], y[:-1], y[1:])

    def _split(self, intervals: _Intervals, budget: int) -> tuple[_Intervals, int]:
        width = intervals.b - intervals.a
        intervals = intervals.kept(width > (1.0 if self._whole else _NARROW * intervals.b))
        if not intervals.a.size:
            return intervals, budget
        budget -= (_PARTS - 1) * intervals.a.size
        if budget < 0:
            raise NumericalError(
                "the step response rings for too long: what it settles to is known, when is not"
            )
        edges = intervals.a[:, None] + (intervals.b - intervals.a)[:, None] * np.arange(_PARTS + 1) / _PARTS
        edges[:, -1] = intervals.b
        if self._whole:
            edges = np.floor(edges)
        inner = self._y.values(edges[:, 1:-1].ravel()).reshape(-1, _PARTS - 1)
        y = np.concatenate((intervals.at_a[:, None], inner, intervals.at_b[:, None]), axis=1)
        made = _Intervals(edges[:, :-1].ravel(), edges[:, 1:].ravel(), y[:, :-1].ravel(), y[:, 1:].ravel())
        return made.kept(made.b > made.a), budget


def outside(y: Real) -> Mask:
    """Outside of the 2 % band; on its edge counts as inside."""
    return (y < BAND[0]) | (y > BAND[1])
