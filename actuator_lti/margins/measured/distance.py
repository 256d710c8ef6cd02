"""How near a measured response comes to -1: the range of modulus and disk margin over points and noise."""

from __future__ import annotations

import numpy as np

from actuator_lti.margins.loop import Complex, Real
from actuator_lti.margins.measured.bounds import Bounds, Strip
from actuator_lti.margins.measured.data import at_once

_PIECES = 32  # of an interval between two points
Range = tuple[float, float]


def distance_ranges(L: Complex, radius: Real, bounds: Bounds) -> tuple[Range, Range]:
    """Ranges of min |1 + L| and of min |2 (1 + L)/(1 - L)| over the measured band.

    From below: the nearest place of every strip between two points, a piece of a ring about the origin. From
    above: the circle of a measured point, which holds the true value; all of them at once, as the
    lowest is taken.
    """
    low, high = _pieces(bounds.log_gain)
    first, last = _pieces(bounds.phase)
    with np.errstate(over="ignore"):
        a, b = np.exp(low), np.exp(high)
    cos = np.cos(_from_minus_one(first, last))
    near = np.clip(cos, a, b)
    least = np.sqrt(np.maximum(near * near - 2.0 * near * cos + 1.0, 0.0))
    together = at_once(radius)
    d, e = np.abs(1.0 + L) + together, np.abs(1.0 - L) - together
    with np.errstate(divide="ignore"):
        above = np.where(e > 0.0, 2.0 * d / e, np.inf)
    return (float(least.min()), float(d.min())), (float(_least_alpha(a, b, cos).min()), float(above.min()))


def _pieces(strip: Strip) -> tuple[Real, Real]:
    """Smallest and largest value over each piece of each interval."""
    t = np.linspace(0.0, 1.0, _PIECES + 1)

    def along(side: Real) -> Real:
        start, end = side[:, :1], side[:, 1:]
        with np.errstate(invalid="ignore"):
            inside = start + t * (end - start)
        return np.where(start == end, start, inside)  # infinity at both ends

    low, high = along(strip.low), along(strip.high)
    return np.minimum(low[:, :-1], low[:, 1:]), np.maximum(high[:, :-1], high[:, 1:])


def _from_minus_one(first: Real, last: Real) -> Real:
    """Smallest angle between the negative real axis and a phase in a range."""
    turns = np.floor((last - np.pi) / (2.0 * np.pi))
    inside = first <= np.pi + 2.0 * np.pi * turns

    def off(phase: Real) -> Real:
        return np.abs(np.mod(phase, 2.0 * np.pi) - np.pi)

    return np.where(inside, 0.0, np.minimum(off(first), off(last)))


def _least_alpha(a: Real, b: Real, cos: Real) -> Real:
    """Smallest 2 sqrt((x - cos)/(x + cos)) with x = (r + 1/r)/2 over a <= r <= b."""

    def mean(r: Real) -> Real:
        with np.errstate(divide="ignore", over="ignore"):
            return 0.5 * (r + 1.0 / r)

    towards_one, away = mean(np.clip(1.0, a, b)), np.maximum(mean(a), mean(b))
    x = np.where(cos > 0.0, towards_one, away)
    with np.errstate(invalid="ignore", divide="ignore"):
        squared = np.where(np.isinf(x), 1.0, np.maximum(x - cos, 0.0) / (x + cos))
    return 2.0 * np.sqrt(squared)
