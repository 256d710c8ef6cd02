"""The smallest distance of a factored loop to -1: modulus margin and balanced disk margin, none overlooked.

What lies nearer than a given distance is a disk in the plane of L: about -1, or for the disk margin about a
point beyond. Over an interval L is a segment but for what the range of its rate allows; intervals that may
reach into the disk are split, and the smallest value found is polished by Newton's method on its slope.
"""

from __future__ import annotations

import math

import numpy as np

from actuator_lti.margins.factors_on_axis import Factored, Intervals, parted
from actuator_lti.margins.loop import Complex, Mask, Real
from actuator_lti.margins.trust import Doubtful

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
        for disk in (False, True):
            value, _ = best[disk]
            distance = _distance(L, disk)
            k = int(distance.argmin())
            if distance[k] < value * (1.0 - _FINEST):
                value, _ = best[disk] = _polished(loop, float(distance[k]), float(here.low[k]), disk)
            if value < _SMALL:
                raise Doubtful("the loop all but meets -1")
        inside = _may_reach(here, best[0][0], best[1][0])
        if not inside.any():
            return best[0], best[1]
        low, high = here.low[inside], here.high[inside]
        if low.size > _MOST:
            break
        here = loop.between_neighbours(parted(low, high))
    raise Doubtful("the smallest distance to -1 was not settled")


def _distance(L: Complex, disk: bool) -> Real:
    with np.errstate(all="ignore"):
        if not disk:
            return np.asarray(np.abs(1.0 + L))
        inner = np.where(np.abs(L) > 1.0, 1.0 / L, L)  # the disk's distance is the same for both
        return np.where(inner == 1.0, np.inf, 2.0 * np.abs((1.0 + inner) / (1.0 - inner)))


def _may_reach(here: Intervals, modulus: float, alpha: float) -> Mask:
    """Whether L may come nearer to -1 than these, anywhere in each interval."""
    least, most = here.bounds()
    width = here.high - here.low
    with np.errstate(all="ignore"):
        start = np.exp(here.first[0] + 1j * here.first[1])
        rate = 0.5 * (here.first[2:] + here.last[2:])
        turn = np.hypot(rate[0], rate[1]) * width
        off = np.hypot(here.spread[2], here.spread[3]) * width
        step = start * np.expm1((rate[0] + 1j * rate[1]) * width)
        gain = np.exp(least[0]), np.exp(most[0])
        error = gain[1] * (0.125 * turn**2 + np.expm1(off) * np.exp(turn))
        segment = start, step, error
        reach = _into(segment, gain, -1.0, modulus * (1.0 - _FINEST))
        k = 0.25 * (alpha * (1.0 - _FINEST)) ** 2
        centre, radius = -(1.0 + k) / (1.0 - k), 2.0 * math.sqrt(k) / (1.0 - k)
        if k < 1.0:
            return reach | _into(segment, gain, centre, radius)
        far = np.maximum(np.abs(start - centre), np.abs(start + step - centre)) + error
        return reach | ~(far < -radius)


def _into(
    segment: tuple[Complex, Complex, Real], gain: tuple[Real, Real], centre: float, radius: float
) -> Mask:
    """Whether a bent segment may reach into a disk; not where its gain alone keeps it out."""
    start, step, error = segment
    share = np.clip(-((start - centre).conj() * step).real / np.abs(step) ** 2, 0.0, 1.0)
    near = np.abs(start + np.where(np.isfinite(share), share, 0.0) * step - centre)
    return np.asarray(~((near - error > radius) | (gain[0] > radius - centre) | (gain[1] < -centre - radius)))


def _polished(loop: Factored, value: float, w: float, disk: bool) -> tuple[float, float]:
    """Newton on the slope of the squared distance; never farther than where it started."""
    best, at = w, w
    for _ in range(_NEWTON_STEPS):
        total = loop.log_value(np.array([at]))
        L = complex(np.exp(total[0, 0] + 1j * total[1, 0]))
        l1, l2 = loop.log_slopes(at)
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
