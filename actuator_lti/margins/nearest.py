"""The smallest distances of a factored loop to -1, none overlooked.

What lies nearer than a given distance is a disk in the plane of L: about -1, or about a point beyond. An
interval is done where the range of gain and phase keeps L out of it, or the way in which the squared distance
to the centre bends between the ends; others are split. The smallest value found is polished by Newton's
method on its slope, and is an end of intervals.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from actuator_lti.margins.distances import Distance
from actuator_lti.margins.factors_on_axis import Factored, Intervals, half_turns, parted
from actuator_lti.margins.loop import Mask, Real
from actuator_lti.margins.trust import EPS, Doubtful

_ROUNDS = 60
_MOST = 100_000
_FINEST = 1e-8  # relative: how much lower another place may be without being found
_SMALL = 1e-6  # nearer to -1 double precision says little
_NEWTON_STEPS = 20
_NEWTON_STEP = 1e-9


Place = tuple[float, float]


def nearest(
    loop: Factored, known: Intervals, distances: tuple[Distance, ...], start: Sequence[Place]
) -> list[Place]:
    """Smallest values of distances, each with its w.

    Parameters
    ----------
    known : Intervals
        They cover the axis but for what ``start``, a place for each distance, stands for.
    """
    best, here = list(start), known
    for _ in range(_ROUNDS):
        L = np.exp(here.first[0] + 1j * here.first[1])
        for m, distance in enumerate(distances):
            values = distance.of(L)
            k = int(values.argmin())
            if values[k] < best[m][0] * (1.0 - _FINEST):
                best[m] = _polished(loop, float(values[k]), float(here.low[k]), distance)
            if best[m][0] < _SMALL:
                raise Doubtful("the loop all but meets -1")
        below = [value * (1.0 - _FINEST) - _rounding(loop, w) for value, w in best]
        nearer = np.array([d.below(value) for d, value in zip(distances, below, strict=True)]).T[..., None]
        inside = _may_reach(here, *nearer)
        which: Any = np.flatnonzero(inside.any(axis=0))
        low, high = here.low[which], here.high[which]
        for _, w in best:
            low, high, which = _cut(low, high, which, w)
        if which.size:
            left = (inside[:, which] & _bends_in(loop, low, high, *nearer)).any(axis=0)
            low, high = low[left], high[left]
        if not low.size:
            return best
        if low.size > _MOST:
            break
        here = loop.between_neighbours(parted(low, high))
    raise Doubtful("the smallest distance to -1 was not settled")


def _rounding(loop: Factored, w: float) -> float:
    """What rounding of the phase makes of a distance there."""
    return 4.0 * EPS * (loop.delay * w if w < math.inf else 0.0)


def _may_reach(here: Intervals, u: Real, v: Real, w: Real) -> Mask:
    """Whether gain and phase allow f = u abs(L)^2 + v Re L + w < 0 in each interval; shape (d, k)."""
    least, most = here.bounds
    gain = np.exp(np.array((least[0], most[0])))
    cosine = np.cos(np.array((least[1], most[1]))).min(axis=0)
    cosine[half_turns(least[1]) != half_turns(most[1])] = -1.0
    v = v * cosine
    lowest = np.minimum(np.maximum(-0.5 * v / u, gain[0]), gain[1])
    values = np.array([(u * at + v) * at for at in (*gain, lowest)])
    return np.asarray(~(values.min(axis=0) + w > 0.0))


def _bends_in(loop: Factored, low: Real, high: Real, u: Real, v: Real, w: Real) -> Mask:
    """Whether it may, by how f bends between the ends of each interval; shape (d, k).

    With l = log L and b = v/2, half of its second derivative is
    abs(L)^2 (u abs(l')^2 + Re((u + b/L)* (l'^2 + l''))): what stands there in the middle, less what the third
    derivative of l over the half width may change.
    """
    total, l1, l2, third = loop.jets(low, high)
    half = 0.5 * (high - low)
    L, two = np.exp(total), half * third
    one = half * (np.abs(l2[1]) + two)
    size, k, over = np.abs(l1[1]), l1[1] ** 2 + l2[1], 0.5 * v / L[1]
    k_off = one * (2.0 * size + one) + two
    grown = half * (size + one)
    bend = np.minimum(u * np.maximum(size - one, 0.0) ** 2, u * (size + one) ** 2)
    bend += ((u + over).conj() * k).real - np.abs(u + over) * k_off
    bend -= np.abs(over) * np.expm1(grown) * (np.abs(k) + k_off)
    bend *= 2.0 * np.abs(L[1]) ** 2 * np.exp(np.copysign(2.0 * grown, -bend))
    ends = L[::2, None]
    value = u * np.abs(ends) ** 2 + v * ends.real + w
    slope = ((2.0 * u * ends.conj() + v) * ends * l1[::2, None]).real
    down = np.array((np.minimum(slope[0], 0.0), np.maximum(slope[1], 0.0)))
    upwards = (value - down**2 / (2.0 * bend)).max(axis=0)
    lowest = np.where(bend > 0.0, upwards, value.min(axis=0) + 0.5 * bend * half**2)
    return np.asarray(~(lowest > 0.0))


def _cut(low: Real, high: Real, which: Any, w: float) -> tuple[Real, Real, Any]:
    """Intervals with one more end."""
    within = (low < w) & (w < high)
    if not within.any():
        return low, high, which
    ends = np.append(np.where(within, w, high), high[within])
    return np.append(low, w), ends, np.append(which, which[within])


def _polished(loop: Factored, value: float, w: float, distance: Distance) -> Place:
    """Newton on the slope of the squared distance; never farther than where it started."""
    best, at = w, w
    a, b, c, e = distance.a, distance.b, distance.c, distance.e
    for _ in range(_NEWTON_STEPS):
        L, l1, l2 = loop.jet(at)
        L1, L2, below = L * l1, L * (l1 * l1 + l2), c * L + e
        G, turned = (a * L + b) / below, (a * e - b * c) / below**2
        G1, G2 = turned * L1, turned * (L2 - 2.0 * c * L1 * L1 / below)
        if abs(G) < value:
            value, best = abs(G), at
        slope, curvature = (G.conjugate() * G1).real, abs(G1) ** 2 + (G.conjugate() * G2).real
        step = -slope / curvature if curvature > 0.0 else -math.copysign(0.2 * at, slope)
        step = max(min(step, at), -0.5 * at)
        at += step
        if abs(step) <= _NEWTON_STEP * at:
            break
    return value, best
