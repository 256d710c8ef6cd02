"""The smallest distance of a factored loop to -1: modulus margin and balanced disk margin, none overlooked.

What lies nearer than a given distance is a disk in the plane of L: about -1, or for the disk margin about a
point beyond. An interval is done where the range of gain and phase keeps L out of both, or the way in which
the squared distance to the centre bends between the ends; others are split. The smallest value found is
polished by Newton's method on its slope, and is an end of intervals.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from actuator_lti.margins.factors_on_axis import Factored, Intervals, half_turns, parted
from actuator_lti.margins.loop import Complex, Mask, Real
from actuator_lti.margins.trust import EPS, Doubtful

_ROUNDS = 60
_MOST = 100_000
_FINEST = 1e-8  # relative: how much lower another place may be without being found
_SMALL = 1e-6  # nearer to -1 double precision says little
_NEWTON_STEPS = 20
_NEWTON_STEP = 1e-9


Place = tuple[float, float]


def nearest(loop: Factored, known: Intervals, start: tuple[Place, Place]) -> tuple[Place, Place]:
    """Smallest |1 + L| and smallest |2 (1 + L)/(1 - L)|, each with its w.

    Parameters
    ----------
    known : Intervals
        They cover the axis but for what ``start``, the same two, stands for.
    """
    best, here = list(start), known
    for _ in range(_ROUNDS):
        L = np.exp(here.first[0] + 1j * here.first[1])
        for disk, distance in enumerate(_distances(L)):
            k = int(distance.argmin())
            if distance[k] < best[disk][0] * (1.0 - _FINEST):
                best[disk] = _polished(loop, float(distance[k]), float(here.low[k]), bool(disk))
            if best[disk][0] < _SMALL:
                raise Doubtful("the loop all but meets -1")
        nearer = _nearer(*(value * (1.0 - _FINEST) - _rounding(loop, w) for value, w in best))
        inside = _may_reach(here, *nearer)
        which: Any = np.flatnonzero(inside.any(axis=0))
        low, high = here.low[which], here.high[which]
        for _, w in best:
            low, high, which = _cut(low, high, which, w)
        if which.size:
            left = (inside[:, which] & _bends_in(loop, low, high, *nearer)).any(axis=0)
            low, high = low[left], high[left]
        if not low.size:
            return best[0], best[1]
        if low.size > _MOST:
            break
        here = loop.between_neighbours(parted(low, high))
    raise Doubtful("the smallest distance to -1 was not settled")


def _distances(L: Complex) -> Real:
    """Both distances, shape (2, k)."""
    size = np.abs(L)
    inner = np.where(size > 1.0, 1.0 / L, L)  # the disk's distance is the same for both
    balanced = 2.0 * np.abs((1.0 + inner) / (1.0 - inner))
    return np.array((np.abs(1.0 + L), np.where(inner == 1.0, np.inf, balanced)))


def _rounding(loop: Factored, w: float) -> float:
    """What rounding of the phase makes of a distance there."""
    return 4.0 * EPS * (loop.delay * w if w < math.inf else 0.0)


def _nearer(modulus: float, alpha: float) -> tuple[Real, Real, Real]:
    """(a, b, e), two rows each: L is nearer than these where f = a abs(L)^2 + 2 b Re L + e < 0."""
    m, k = modulus**2, 0.25 * alpha**2
    a, b, e = np.array((((1.0,), (1.0 - k,)), ((1.0,), (1.0 + k,)), ((1.0 - m,), (1.0 - k,))))
    return a, b, e


def _may_reach(here: Intervals, a: Real, b: Real, e: Real) -> Mask:
    """Whether gain and phase allow L to come nearer, anywhere in each interval; shape (2, k)."""
    least, most = here.bounds
    gain = np.exp(np.array((least[0], most[0])))
    cosine = np.cos(np.array((least[1], most[1]))).min(axis=0)
    cosine[half_turns(least[1]) != half_turns(most[1])] = -1.0
    b = b * cosine
    lowest = np.minimum(np.maximum(-b / a, gain[0]), gain[1])
    values = np.array([(a * at + 2.0 * b) * at for at in (*gain, lowest)])
    return np.asarray(~(values.min(axis=0) + e > 0.0))


def _bends_in(loop: Factored, low: Real, high: Real, a: Real, b: Real, e: Real) -> Mask:
    """Whether it may, by how f bends between the ends of each interval; shape (2, k).

    With l = log L half of its second derivative is abs(L)^2 (a abs(l')^2 + Re((a + b/L)* (l'^2 + l''))): what
    stands there in the middle, less what the third derivative of l over the half width may change.
    """
    total, l1, l2, third = loop.jets(low, high)
    half = 0.5 * (high - low)
    L, two = np.exp(total), half * third
    one = half * (np.abs(l2[1]) + two)
    size, k, over = np.abs(l1[1]), l1[1] ** 2 + l2[1], b / L[1]
    k_off = one * (2.0 * size + one) + two
    grown = half * (size + one)
    bend = np.minimum(a * np.maximum(size - one, 0.0) ** 2, a * (size + one) ** 2)
    bend += ((a + over).conj() * k).real - np.abs(a + over) * k_off
    bend -= np.abs(over) * np.expm1(grown) * (np.abs(k) + k_off)
    bend *= 2.0 * np.abs(L[1]) ** 2 * np.exp(np.copysign(2.0 * grown, -bend))
    ends = L[::2, None]
    value = a * np.abs(ends) ** 2 + 2.0 * b * ends.real + e
    slope = 2.0 * ((a * ends.conj() + b) * ends * l1[::2, None]).real
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


def _polished(loop: Factored, value: float, w: float, disk: bool) -> Place:
    """Newton on the slope of the squared distance; never farther than where it started."""
    best, at = w, w
    for _ in range(_NEWTON_STEPS):
        L, l1, l2 = loop.jet(at)
        G, G1, G2 = 1.0 + L, L * l1, L * (l1 * l1 + l2)
        if disk:
            below = 1.0 - L
            G, G1, G2 = 2.0 * G / below, 4.0 * G1 / below**2, 4.0 * G2 / below**2 + 8.0 * G1**2 / below**3
        if abs(G) < value:
            value, best = abs(G), at
        slope, curvature = (G.conjugate() * G1).real, abs(G1) ** 2 + (G.conjugate() * G2).real
        step = -slope / curvature if curvature > 0.0 else -math.copysign(0.2 * at, slope)
        step = max(min(step, at), -0.5 * at)
        at += step
        if abs(step) <= _NEWTON_STEP * at:
            break
    return value, best
