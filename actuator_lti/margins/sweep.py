"""Intervals over a band, split until a bound shows that nothing hides inside any of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from actuator_lti.errors import NumericalError
from actuator_lti.margins.delay_form import DelayForm, Intervals, evaluate_intervals
from actuator_lti.margins.loop import Complex, Mask, Real
from actuator_lti.margins.trust import TOUCH

RESOLVED = 0.05  # change inside an interval, relative to the value, below which it is not split further
_MOST = 400_000
_MOST_SLOW = 30_000  # below the turns of the delay: poles that need more are lost in rounding
_NARROWEST = 1e-12
_STEPS = 80
_CLOSE = 1e-14


def variation(form: DelayForm, intervals: Intervals) -> Real:
    """Bound of |L - L(x)| inside each interval, the series delay included."""
    return intervals.spread + np.abs(intervals.L) * np.minimum(intervals.half * form.series, 2.0)


def subdivided(form: DelayForm, edges: Real, resolved: Callable[[Intervals], Mask]) -> Intervals:
    """Split the intervals between ``edges`` in two until ``resolved`` holds in each; in order of x.

    Raises
    ------
    NumericalError
        An interval would have to be split without end: a pole on the border of stability, or a band that
        holds too many turns of the delay.
    """
    low, high = edges[:-1], edges[1:]
    done: list[Intervals] = []
    count = 0
    while low.size:
        intervals = evaluate_intervals(form, low, high)
        count += low.size
        good = resolved(intervals)
        done.append(_taken(intervals, good))
        low, high = low[~good], high[~good]
        if count > (_MOST if _turning(form, high) else _MOST_SLOW):
            raise NumericalError(
                f"{count} intervals up to {edges[-1]:.4g} rad/s did not do: {_why(form, high)}"
            )
        if low.size and float(((high - low) / high).min()) < _NARROWEST:
            raise NumericalError(
                f"the loop is not bounded near {low[0]:.10g}: a pole on the border of stability"
            )
        middle = 0.5 * (low + high)
        low, high = np.concatenate((low, middle)), np.concatenate((middle, high))
    return joined(done)


def _turning(form: DelayForm, unsettled: Real) -> bool:
    """Whether a delay turns the loop at all up to these frequencies."""
    longest = max([form.series, *form.delays.tolist()], default=0.0)
    return float(unsettled.max(initial=0.0)) * longest > 1.0


def _why(form: DelayForm, unsettled: Real) -> str:
    if _turning(form, unsettled):
        return (
            "the delay turns the loop too many times while its gain is of consequence; shorten the delay, or "
            "ask for a narrower band_rad_s"
        )
    return (
        f"rounding hides the loop below {unsettled.max(initial=0.0):.3g} rad/s, where its gain rises too far "
        "(slow poles beside those at zero)"
    )


def _taken(intervals: Intervals, mask: Mask) -> Intervals:
    return Intervals(*(getattr(intervals, name)[mask] for name in Intervals.__dataclass_fields__))


def joined(parts: list[Intervals]) -> Intervals:
    """Several sets of intervals as one, in order of x."""
    order = np.concatenate([p.x for p in parts]).argsort()
    return Intervals(
        *(np.concatenate([getattr(p, name) for p in parts])[order] for name in Intervals.__dataclass_fields__)
    )


@dataclass(frozen=True)
class Level:
    """A real function of L whose zeros are wanted: its value, its rate by x, and whether a zero counts."""

    value: Callable[[Complex], Real]
    rate: Callable[[Complex, Complex], Real]
    counts: Callable[[Complex], Mask]


GAIN = Level(lambda L: np.log(np.abs(L)), lambda L, d: (d / L).real, lambda L: np.ones(L.shape, dtype=bool))
PHASE = Level(lambda L: np.angle(-L), lambda L, d: (d / L).imag, lambda L: L.real < 0.0)


def crossings(form: DelayForm, intervals: Intervals, level: Level, skip: Mask) -> tuple[Real, Mask]:
    """Zeros of a level between neighbouring middles; ``skip`` marks intervals that cannot hold one.

    Returns
    -------
    x : array
        Where, in order.
    touch : array of bool
        Whether the level is only touched there.
    """
    value, rate = level.value(intervals.L), level.rate(intervals.L, intervals.slope)
    near = ~(skip[1:] & skip[:-1]) & (np.abs(value[1:] - value[:-1]) < 3.0)  # else the angle wraps
    x = _roots(form, level, intervals.x, value, np.flatnonzero(near & (value[1:] * value[:-1] <= 0.0)))
    turns = (
        near & (value[:-1] * rate[:-1] < 0.0) & (value[1:] * rate[1:] > 0.0) & (value[1:] * value[:-1] > 0.0)
    )
    pairs: list[tuple[float, bool]] = []
    for k in np.flatnonzero(turns):
        pairs += _near_turn(form, level, float(intervals.x[k]), float(intervals.x[k + 1]), float(value[k]))
    all_x = np.concatenate((x, [at for at, _ in pairs]))
    touch = np.concatenate((np.zeros(x.size, dtype=bool), [flat for _, flat in pairs])).astype(bool)
    order = all_x.argsort()
    return all_x[order], touch[order]


def _at(form: DelayForm, x: Real) -> Intervals:
    return evaluate_intervals(form, x, x)


def _roots(form: DelayForm, level: Level, x: Real, value: Real, hit: NDArray[np.intp]) -> Real:
    """Newton in all brackets [x[k], x[k + 1]] at once, bisection wherever it would leave its own."""
    if not hit.size:
        return np.empty(0)
    low, high, side = x[hit], x[hit + 1], value[hit]
    share = np.abs(value[hit]) / np.maximum(np.abs(value[hit]) + np.abs(value[hit + 1]), 1e-300)
    at = low + share * (high - low)
    for _ in range(_STEPS):
        point = _at(form, at)
        here = level.value(point.L)
        before = here * side > 0.0
        low, high = np.where(before, at, low), np.where(before, high, at)
        ahead = at - here / level.rate(point.L, point.slope)
        ahead = np.where((ahead >= low) & (ahead <= high), ahead, 0.5 * (low + high))
        done = np.abs(ahead - at) <= _CLOSE * at
        at = ahead
        if done.all():
            break
    return at[level.counts(_at(form, at).L)]


def _near_turn(
    form: DelayForm, level: Level, low: float, high: float, side: float
) -> list[tuple[float, bool]]:
    """Where the level turns back between two points: no zero, a touch, or a pair of zeros."""

    def value(x: float) -> float:
        return float(level.value(_at(form, np.array([x])).L)[0])

    def rate(x: float) -> float:
        one = _at(form, np.array([x]))
        return float(level.rate(one.L, one.slope)[0])

    def root(function: Callable[[float], float], start: float, stop: float) -> float:
        return float(brentq(function, start, stop, xtol=1e-300, rtol=1e-15, maxiter=300))

    top = root(rate, low, high)
    peak = value(top)
    if abs(peak) <= TOUCH:
        return [(top, True)]
    return [(root(value, low, top), False), (root(value, top, high), False)] if peak * side < 0.0 else []
