"""Every crossing of a factored loop between two frequencies: nothing left out.

Intervals are split until in each of them the bounds of `factors_on_axis` say that the loop stays off the
line, or moves over it one way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator_lti.margins.assemble import FARTHEST
from actuator_lti.margins.factors_on_axis import Factored, Intervals, half_turns, halves
from actuator_lti.margins.loop import Mask, Real

FAR_LOG = math.log(FARTHEST)
_REAL = 1e-9  # rad
_STEPS = 60
_STEP = 1e-5  # relative: near enough for the loop itself to go on


@dataclass(frozen=True)
class Found:
    """Where a factored loop meets the unit circle and the negative real axis.

    Attributes
    ----------
    gain_w, real_w : arrays
        In order.
    rising : array of bool
        Whether the phase rises at each of ``real_w``.
    far : int
        Crossings of the negative real axis with a gain below -200 dB, which are not listed.
    turns : int
        Rising less falling ones among those not listed where the gain is above one.
    known : Intervals
        They cover all that was searched, in order.
    """

    gain_w: Real
    real_w: Real
    rising: Mask
    far: int
    turns: int
    known: Intervals


def search(loop: Factored, low: float, high: float, listed_to: float = math.inf) -> Found:
    """Find all crossings with low < w < high; of the real axis only those up to ``listed_to``.

    A crossing at w = 0 itself, where low is 0, is not listed.

    Raises
    ------
    Doubtful
        The loop comes so near to a line that its side could not be told.
    """
    ends = [low, *([listed_to] if low < listed_to < high else []), high]
    known = loop.covered(ends, lambda here: _clear(here, listed_to, loop.slack))
    return _read(loop, known, low == 0.0, listed_to)


def passages(loop: Factored, low: float, high: float, level: float, kind: int = 0) -> Real:
    """Every w between two at which the log gain (0) or the phase (1) passes a level, in order."""

    def clear(here: Intervals) -> Mask:
        one_way = (here.least[kind + 2] > 0.0) | (here.most[kind + 2] < 0.0)
        least, most = here.bounds
        return np.asarray(one_way | (least[kind] > level) | (most[kind] < level))

    known = loop.covered([low, high], clear)
    hit = np.flatnonzero((known.first[kind] > level) != (known.last[kind] > level))
    return _roots(loop, np.full(hit.size, kind), known, hit, np.full(hit.size, level))


def _clear(here: Intervals, listed_to: float, slack: float) -> Mask:
    one_way = (here.least[2:] > 0.0) | (here.most[2:] < 0.0)
    least, most = here.bounds
    off_circle = (least[0] > slack) | (most[0] < -slack)
    off_axis = half_turns(least[1] - slack) == half_turns(most[1] + slack)
    out_of_sight = (most[0] < -FAR_LOG) | (here.low >= listed_to)
    clear: Mask = (one_way[0] | off_circle) & (one_way[1] | off_axis | out_of_sight)
    return clear


def _read(loop: Factored, known: Intervals, from_zero: bool, listed_to: float) -> Found:
    first, last = half_turns(known.first[1]), half_turns(known.last[1])
    if from_zero and abs(math.sin(known.first[1, 0])) < _REAL:  # it leaves the real axis there, one way
        first[0] = half_turns(known.first[1, 0] + math.copysign(2.0 * _REAL, known.first[3, 0]))
    listed = known.low < listed_to
    least, most = known.bounds
    seen = (most[0] >= -FAR_LOG) & listed
    step = (last - first).astype(int)
    hit = ((known.first[0] > 0.0) != (known.last[0] > 0.0)).nonzero()[0]
    turned = (seen & (step != 0)).nonzero()[0]
    which = turned.repeat(np.abs(step[turned]))
    rising = step[which] > 0
    number = np.arange(which.size) - np.searchsorted(which, which)
    level = np.where(rising, first[which] + 1 + number, first[which] - number) * 2.0 * math.pi - math.pi
    kind = np.zeros(hit.size + which.size, dtype=int)
    kind[hit.size :] = 1
    level = np.concatenate((np.zeros(hit.size), level))
    w = _roots(loop, kind, known, np.concatenate((hit, which)), level)
    gain_w, real_w = w[: hit.size], w[hit.size :]
    gain_w.sort()
    order = real_w.argsort()
    return Found(
        gain_w,
        real_w[order],
        rising[order],
        int(np.abs(step[~seen & listed]).sum()),
        int(step[~seen & (least[0] > 0.0)].sum()),
        known,
    )


def _roots(loop: Factored, kind: Any, known: Intervals, which: Any, level: Real) -> Real:
    """Where gain (0) or phase (1), monotone in each interval, takes a level: Newton held by bisection."""
    low, high = known.low[which], known.high[which]
    if not low.size:
        return low
    each = np.arange(which.size)
    first, last = known.first[kind, which] - level, known.last[kind, which] - level
    above = first > 0.0
    at = low + (high - low) * (first / (first - last))
    for _ in range(_STEPS):
        total = loop.log_value(at)
        here = total[kind, each] - level
        before = (here > 0.0) == above
        low, high = np.where(before, at, low), np.where(before, high, at)
        ahead = at - here / total[kind + 2, each]
        ahead = np.where((ahead >= low) & (ahead <= high), ahead, halves(low, high))
        small = np.abs(ahead - at) <= _STEP * at
        at = ahead
        if small.all():
            break
    return at
