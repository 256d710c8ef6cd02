"""A step response over its final value: what comes first, point by point, and then its exponentials."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from actuator_lti.margins.loop import Real
from actuator_lti.step_search import BAND, Search, outside
from actuator_lti.step_terms import Exponentials

_SHOWN = 4000
_OVER = 1e-9  # an excess below this part of the final value is no overshoot


class Early(Protocol):
    """The first part of a response, relative to the final value."""

    @property
    def end(self) -> float:
        """From when on the exponentials hold."""

    def reached(self, level: float) -> float | None:
        """First time at or above a level; ``None``: not in this part."""

    def inside_from(self) -> float:
        """From when on this part stays within the band (0: all of it; ``end``: not even its last point)."""

    def peak(self) -> tuple[float, float]:
        """Largest value and when."""

    def at(self, time: Real) -> Real:
        """Values at times before ``end``."""


@dataclass(frozen=True)
class Samples:
    """The first samples of a sampled response (none of a continuous one)."""

    y: Real

    @property
    def end(self) -> float:
        """The first sample that is not among them."""
        return float(self.y.size)

    def reached(self, level: float) -> float | None:
        """First sample at or above a level."""
        hit = np.flatnonzero(self.y >= level)
        return float(hit[0]) if hit.size else None

    def inside_from(self) -> float:
        """The sample after the last one outside."""
        hit = np.flatnonzero(outside(self.y))
        return float(hit[-1]) + 1.0 if hit.size else 0.0

    def peak(self) -> tuple[float, float]:
        """Largest sample."""
        return (float(self.y.max()), float(self.y.argmax())) if self.y.size else (-np.inf, np.inf)

    def at(self, time: Real) -> Real:
        """Samples by number."""
        return self.y[time.astype(int)]


@dataclass(frozen=True)
class Stepped:
    """A response on a grid that can be asked between its points too: ``between(k, t)`` in interval k."""

    time: Real
    y: Real
    between: Callable[[int, float], float]

    @property
    def end(self) -> float:
        """The last point."""
        return float(self.time[-1])

    def reached(self, level: float) -> float | None:
        """First passage, located in its interval."""
        hit = np.flatnonzero(self.y >= level)
        if not hit.size:
            return None
        return self._located(int(hit[0]) - 1, level) if hit[0] else float(self.time[0])

    def inside_from(self) -> float:
        """Last passage into the band."""
        hit = np.flatnonzero(outside(self.y))
        if not hit.size:
            return 0.0
        k = int(hit[-1])
        if k + 1 == self.y.size:
            return self.end
        return self._located(k, BAND[1] if self.y[k] > 1.0 else BAND[0])

    def peak(self) -> tuple[float, float]:
        """Largest value, located beside the largest point."""
        time, y = self.time, self.y
        k = int(y.argmax())
        if k in (0, y.size - 1):
            return float(y[k]), float(time[k])

        def below(t: float) -> float:
            return -self.between(k - 1 if t < time[k] else k, t)

        minimum = minimize_scalar(below, bounds=(time[k - 1], time[k + 1]), method="bounded",
                                options={"xatol": 1e-10 * float(time[k + 1])})  # fmt: skip
        return (
            (-float(minimum.fun), float(minimum.x)) if -minimum.fun > y[k] else (float(y[k]), float(time[k]))
        )

    def at(self, time: Real) -> Real:
        """Each in its interval."""
        interval = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, self.time.size - 2)
        return np.array([self.between(int(k), float(t)) for k, t in zip(interval, time, strict=True)])

    def _located(self, k: int, level: float) -> float:
        """Where the response passes a level between grid points k and k + 1."""
        a, b = float(self.time[k]), float(self.time[k + 1])
        low, high = self.between(k, a) - level, self.between(k, b) - level
        if low * high >= 0.0:
            return a if abs(low) < abs(high) else b
        return float(brentq(lambda t: self.between(k, t) - level, a, b, xtol=1e-300, rtol=1e-13))


@dataclass(frozen=True)
class Response:
    """The whole response; time in s, or in samples where ``whole``."""

    early: Early
    later: Exponentials
    whole: bool

    @property
    def _search(self) -> Search:
        return Search(self.later, self.early.end, self.whole)

    def reached(self, level: float) -> float:
        """First time at or above a level."""
        early = self.early.reached(level)
        if early is not None:
            return early
        return self.early.end if self.later.empty else self._search.first_at_least(level)

    def settled(self) -> float:
        """From when on the response stays within the band."""
        last = None if self.later.empty else self._search.last_outside()
        if last is None:
            return self.early.inside_from()
        return last + 1.0 if self.whole else last

    def peak(self) -> tuple[float, float]:
        """Largest value and when; 1 and infinity where it is never above the final value."""
        best, place = self.early.peak()
        if not best > 1.0 + _OVER:
            best, place = 1.0 + _OVER, float("inf")
        if not self.later.empty:
            result, at = self._search.greatest(best)
            if result > best:
                best, place = result, self.later.top(at) if not self.whole and at > 0.0 else at
        return (best, place) if np.isfinite(place) else (1.0, place)

    def at(self, time: Real) -> Real:
        """The response at the times given."""
        y = np.empty(time.size)
        early = time < self.early.end
        y[early] = self.early.at(time[early])
        y[~early] = 1.0 if self.later.empty else self.later.values(time[~early])
        return y

    def shown(self, ninety: float, settled: float) -> Real:
        """Times to look at the response, until well after settling; close together while it rises."""
        end = 2.0 * settled if settled > 0.0 else 2.0 * ninety
        if end == 0.0:
            end = 1.0 if self.later.empty else 5.0 / self.later.slowest
        end = max(end, self.early.end if self.whole else 0.0)
        rising = np.linspace(0.0, min(5.0 * ninety, end), _SHOWN // 4) if ninety > 0.0 else np.zeros(1)
        time = np.concatenate((rising, np.linspace(0.0, end, _SHOWN - rising.size)))
        return np.unique(np.ceil(time) if self.whole else time)
