"""What a factored loop does on the axis: every crossing and passage of a level, its smallest distance to -1.

The search is compiled (`actuator_lti.axis`); here it is called, with as much room as it needs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_lti.axis import _nearest, _search
from actuator_lti.axis._factors import BOUNDS, slot
from actuator_lti.axis.library import LIBRARY
from actuator_lti.margins.distances import Distance
from actuator_lti.margins.factors_on_axis import Factored
from actuator_lti.margins.loop import Mask, Real
from actuator_lti.margins.trust import Doubtful

_ROOM, _MORE, _MOST = 1 << 11, 8, 1 << 23  # intervals: asked for first, each time more, and no more than that
Place = tuple[float, float]


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
    rate : float
        Of the phase, at the beginning.
    intervals : int
        Into how many the axis was split.
    known : array (intervals + 1, 7)
        For each where it begins, log gain and phase there, and inside their least, then their most; the last
        row is the end.
    """

    gain_w: Real
    real_w: Real
    rising: Mask
    far: int
    turns: int
    rate: float
    intervals: int
    known: Real


def search(loop: Factored, low: float, high: float, listed_to: float = math.inf) -> Found:
    """Find all crossings with low < w < high; of the real axis only those up to ``listed_to``.

    A crossing at w = 0 itself, where low is 0, is not listed.

    Raises
    ------
    Doubtful
        The loop comes so near to a line that its side could not be determined.
    """
    ends = [low, *([listed_to] if low < listed_to < high else []), high]
    return _searched(loop, ends, _search.CIRCLE, 0.0, listed_to)


def passages(loop: Factored, low: float, high: float, level: float, kind: int = _search.GAIN_LEVEL) -> Real:
    """Every w between two at which the log gain (0) or the phase (1) passes a level, in order."""
    return _searched(loop, [low, high], kind, level, math.inf).gain_w


def _searched(loop: Factored, ends: list[float], kind: int, level: float, listed_to: float) -> Found:
    places = loop.places
    edges = np.sort(np.concatenate((ends, places[(places > ends[0]) & (places < ends[-1])])))
    room = _ROOM
    while True:
        known, gains, reals = np.empty((room + 1, _search.KNOWN)), np.empty(room), np.empty((room, 2))
        found = np.zeros(_search.FOUND)
        status = LIBRARY.functions.search(
            *_row(loop), kind, level, listed_to, edges.size, edges, room, known.reshape(-1), gains,
            reals.reshape(-1), found, *_lent(loop),
        )  # fmt: skip
        if status != _search.FULL or room > _MOST:
            break
        room *= _MORE
    if status != _search.DONE:
        raise Doubtful(f"the loop comes too near to a line at {found[_search.WHERE]:.6g} to tell its side")
    intervals, crossed, turned, far, turns = found[: _search.RATE].astype(int).tolist()
    return Found(gains[:crossed], reals[:turned, 0], reals[:turned, 1] > 0.0, far, turns,
                 float(found[_search.RATE]), intervals, known[: intervals + 1])  # fmt: skip


def nearest(
    loop: Factored, found: Found, distances: tuple[Distance, ...], start: Sequence[Place]
) -> list[Place]:
    """Smallest values of distances, each with its w.

    Parameters
    ----------
    found : Found
        Its intervals cover the axis but for what ``start``, a place for each distance, stands for.
    """
    out = []
    for d, place in zip(distances, start, strict=True):
        best, form = np.array(place), np.array((d.a, d.b, d.c, d.e), dtype=float)
        status = LIBRARY.functions.nearest(
            *_row(loop), found.intervals, found.known.reshape(-1), form, best, *_lent(loop)
        )
        if status == _nearest.MEETS:
            raise Doubtful("the loop all but meets -1")
        if status != _search.DONE:
            raise Doubtful("the smallest distance to -1 was not settled")
        out.append((float(best[0]), float(best[1])))
    return out


def gain_bounds(loop: Factored, low: Real, high: Real) -> tuple[Real, Real]:
    """The least and the greatest gain in each of many intervals, between places."""
    least, most = np.empty(low.size), np.empty(low.size)
    LIBRARY.functions.gain_bounds(*_row(loop), low.size, low, high, least, most, *_lent(loop))
    return least, most


def _row(loop: Factored) -> tuple[int, Real]:
    return loop.roots.size, loop.table


def _lent(loop: Factored) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return np.empty((_search.DEEPEST + 2) * slot(loop.roots.size)), np.empty(BOUNDS)
