"""Crossings of a rational loop: candidates from eigenvalues, held by a change of sign, polished by Newton."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from actuator_lti.errors import NumericalError
from actuator_lti.margins.circles import Circles, on_axis, unwarped, warped
from actuator_lti.margins.loop import Complex, Mask, RationalLoop, Real

TOUCH = 1e-9  # how near to one (gain) or to the axis (rad) a touching curve counts as touching
_POSSIBLE_TOUCH = 1e-3
_NEWTON_STEP = 1e-9
_NEWTON_STEPS = 8
_SAME = 1e-8
_AT_POLE = 1e-7
_NONE = np.empty(0, dtype=complex)


@dataclass(frozen=True)
class Crossings:
    """All points at which L meets the unit circle or the real axis, inside the band (ends left out).

    Attributes
    ----------
    gain_x, gain_L, gain_touch : arrays
        Where |L| = 1, L there, and whether it only touches.
    real_x, real_L, real_touch : arrays
        The same for the real axis, positive side included.
    between_x, between_L : arrays
        Points in order, with at least one between any two neighbours of ``real_x`` and border poles, one
        before and one after.
    """

    gain_x: Real
    gain_L: Complex
    gain_touch: Mask
    real_x: Real
    real_L: Complex
    real_touch: Mask
    between_x: Real
    between_L: Complex


@dataclass(frozen=True)
class _Candidates:
    x: Real  # sorted, border poles among them
    off_axis: Real  # distance of the candidate to the border of stability over its frequency
    is_pole: Mask
    samples: Real  # one more than x

    @property
    def possible_touch(self) -> Mask:
        return self.off_axis <= _POSSIBLE_TOUCH

    @property
    def count(self) -> int:
        return self.x.size


def find_crossings(
    loop: RationalLoop, circles: Circles, border_x: Real, typical_x: Real, floor_x: float
) -> Crossings:
    """Find every crossing of the unit circle and of the real axis with 0 < x < end.

    Parameters
    ----------
    loop, circles : RationalLoop, Circles
        At least one state.
    border_x : array
        Poles on the border, 0 < x < end.
    typical_x : array
        Further frequencies at which to look at the signs.
    floor_x : float
        Below this, where a multiple pole at zero frequency is scattered, L only follows that pole.

    Raises
    ------
    NumericalError
        The gain is one at every frequency.
    """
    gain_zeros = circles.circle(1.0, 0.0, -1.0)
    if gain_zeros is None:
        raise NumericalError("the gain of the loop is one at every frequency: it has no phase margin")
    real_zeros = circles.real_axis()
    gain = _candidates(gain_zeros, border_x, loop.in_z, floor_x)
    real = _candidates(_NONE if real_zeros is None else real_zeros, border_x, loop.in_z, floor_x)
    x = np.concatenate((gain.samples, real.samples, typical_x))
    x.sort()
    L = loop.response(x)
    gain_changes = _changes(np.abs(L) > 1.0)
    real_changes = np.zeros(x.size - 1, dtype=bool) if real_zeros is None else _changes(L.imag > 0.0)
    if border_x.size:
        at_pole = np.searchsorted(x, border_x) - 1
        gain_changes[at_pole] = real_changes[at_pole] = False
    gain_hit, real_hit = np.flatnonzero(gain_changes), np.flatnonzero(real_changes)
    both = np.concatenate((gain_hit, real_hit))
    k = gain_hit.size
    start = np.concatenate((_start(gain, x, gain_hit), _start(real, x, real_hit)))
    root, values = _polish(loop, start, x[both], x[both + 1], k)
    gain_x, gain_L, gain_touch = _with_touches(loop, gain, root[:k], values[:k], True)
    real_x, real_L, real_touch = _with_touches(loop, real, root[k:], values[k:], False)
    return Crossings(gain_x, gain_L, gain_touch, real_x, real_L, real_touch, x, L)


def gain_crossings(loop: RationalLoop, circles: Circles) -> Real:
    """Only the crossings of the unit circle, 0 < x < end, points of touch left out; no border poles."""
    zeros = circles.circle(1.0, 0.0, -1.0)
    if zeros is None:
        return np.empty(0)
    found = _candidates(zeros, np.empty(0), loop.in_z, 0.0)
    if not found.count:
        return np.empty(0)
    x = found.samples
    hit = np.flatnonzero(_changes(np.abs(loop.response(x)) > 1.0))
    root, values = _polish(loop, found.x[hit], x[hit], x[hit + 1], hit.size)
    root, _, touch = _with_touches(loop, found, root, values, True)
    return root[~touch]


def _changes(side: Mask) -> Mask:
    return side[1:] != side[:-1]


def _start(found: _Candidates, x: Real, hit: NDArray[np.intp]) -> Real:
    """Where Newton starts in each interval [x[k], x[k + 1]]: its candidate, or its middle."""
    low, high = x[hit], x[hit + 1]
    if not found.count:
        return np.sqrt(low * high)
    k = np.minimum(np.searchsorted(found.x, low), found.count - 1)
    at = found.x[k]
    return np.where((at > low) & (at < high) & ~found.is_pole[k], at, np.sqrt(low * high))


def _candidates(zeros: Complex, border_x: Real, in_z: bool, floor_x: float) -> _Candidates:
    near = on_axis(zeros)
    if floor_x:
        near = near[near.imag > (math.tan(0.5 * floor_x) if in_z else floor_x)]
    w, off_axis = near.imag, np.abs(near.real) / near.imag
    if (
        w.size > 1 and (w[1:] - w[:-1] <= _SAME * w[1:]).any()
    ):  # one candidate twice, or a pair: looked at as one
        first = np.flatnonzero(np.concatenate(([True], w[1:] - w[:-1] > _SAME * w[1:])))
        w, off_axis = w[first], np.minimum.reduceat(off_axis, first)
    pole = np.zeros(w.size, dtype=bool)
    if border_x.size:
        pole_w = warped(border_x, in_z)
        apart = (np.abs(w[:, None] - pole_w) > _AT_POLE * pole_w).all(axis=1)  # L - L~ has the pole itself
        w, off_axis, pole = w[apart], off_axis[apart], pole[apart]
        w = np.concatenate((w, pole_w))
        pole = np.concatenate((pole, np.ones(border_x.size, dtype=bool)))
        off_axis = np.concatenate((off_axis, np.full(border_x.size, np.inf)))
        order = w.argsort()
        w, pole, off_axis = w[order], pole[order], off_axis[order]
    samples = np.empty(w.size + 1 if w.size else 0)
    if w.size:
        samples[0], samples[-1] = 0.5 * w[0], 2.0 * w[-1]
        samples[1:-1] = np.sqrt(w[:-1] * w[1:])
    return _Candidates(unwarped(w, in_z), off_axis, pole, unwarped(samples, in_z))


def _polish(loop: RationalLoop, x: Real, low: Real, high: Real, gains: int) -> tuple[Real, Complex]:
    """Newton on log |L| (the first ``gains`` ones) or on the phase; every root stays in its bracket."""
    if not x.size:
        return x, np.empty(0, dtype=complex)
    failed = np.zeros(x.size, dtype=bool)
    start = x
    for _ in range(_NEWTON_STEPS):
        L, slope = loop.response_and_slope(x)
        rate = slope / L
        step = np.empty(x.size)
        step[:gains] = np.log(np.abs(L[:gains])) / rate.real[:gains]
        turned = L[gains:] * np.sign(L.real[gains:])
        step[gains:] = np.arctan2(turned.imag, turned.real) / rate.imag[gains:]
        x = x - step
        failed = ~((x > low) & (x < high))
        small = np.abs(step) <= _NEWTON_STEP * x
        if (small | failed).all():
            break
        x[failed] = start[failed]
    else:
        failed |= ~small
    value = L - slope * step
    for k in np.flatnonzero(failed):
        x[k] = _bracketed(loop, float(low[k]), float(high[k]), bool(k < gains))
        value[k] = loop.response(x[k : k + 1])[0]
    return x, value


def _function(loop: RationalLoop, x: float, gain: bool) -> float:
    L = complex(loop.response(np.array([x]))[0])
    return float(np.log(abs(L))) if gain else L.imag / abs(L)


def _bracketed(loop: RationalLoop, low: float, high: float, gain: bool) -> float:
    ends = _function(loop, low, gain), _function(loop, high, gain)
    if ends[0] * ends[1] >= 0.0:  # the change of sign is within rounding: it is at the smaller one
        return low if abs(ends[0]) < abs(ends[1]) else high
    root = brentq(lambda x: _function(loop, x, gain), low, high, xtol=1e-300, rtol=1e-15, maxiter=300)
    return float(root)


def _with_touches(
    loop: RationalLoop, found: _Candidates, x: Real, L: Complex, gain: bool
) -> tuple[Real, Complex, Mask]:
    """Add pairs of crossings that are too close for the samples, and points of touch."""
    flat = np.zeros(x.size, dtype=bool)
    if not found.possible_touch.any():
        return x, L, flat
    known: Mask = np.zeros(found.count, dtype=bool)
    if x.size:
        nearest = np.clip(np.searchsorted(x, found.x), 1, max(x.size - 1, 1))
        pair = np.stack((x[nearest - 1], x[np.minimum(nearest, x.size - 1)]))
        known = np.asarray((np.abs(pair - found.x) <= 1e-6 * found.x).any(axis=0))
    open_question = found.possible_touch & ~known
    if not open_question.any():
        return x, L, flat
    more: list[float] = []
    touch: list[bool] = []
    for k in np.flatnonzero(open_question):
        at = float(found.x[k])
        near = 10.0 * float(found.off_axis[k]) + 1e-6
        low, high = max(at / (1.0 + near), found.samples[k]), min(at * (1.0 + near), found.samples[k + 1])
        _near_touch(loop, float(low), float(high), gain, more, touch)
        _near_touch(loop, float(found.samples[k]), float(found.samples[k + 1]), gain, more, touch)
        if k + 1 < found.count and open_question[k + 1]:
            _near_touch(loop, float(found.samples[k]), float(found.samples[k + 2]), gain, more, touch)
    return _merged(loop, x, L, np.array(more), np.array(touch, dtype=bool))


def _near_touch(
    loop: RationalLoop, low: float, high: float, gain: bool, more: list[float], touch: list[bool]
) -> None:
    def slope(x: float) -> float:
        L, d = loop.response_and_slope(np.array([x]))
        rate = complex(d[0] / L[0])
        return rate.real if gain else rate.imag

    if slope(low) * slope(high) >= 0.0:
        return
    top = float(brentq(slope, low, high, xtol=1e-300, rtol=1e-15, maxiter=300))
    value, side = _function(loop, top, gain), _function(loop, low, gain)
    if abs(value) <= TOUCH:
        more.append(top)
        touch.append(True)
        return
    if value * side < 0.0:
        more.append(_bracketed(loop, low, top, gain))
        touch.append(False)
    if value * _function(loop, high, gain) < 0.0:
        more.append(_bracketed(loop, top, high, gain))
        touch.append(False)


def _merged(loop: RationalLoop, x: Real, L: Complex, more: Real, touch: Mask) -> tuple[Real, Complex, Mask]:
    keep = np.ones(more.size, dtype=bool)
    for k in range(more.size):
        near_known = np.abs(x - more[k]) <= 1e-6 * more[k]
        near_new = np.abs(more[:k][keep[:k]] - more[k]) <= 1e-9 * more[k]
        keep[k] = not (near_known.any() or near_new.any())
    more, touch = more[keep], touch[keep]
    if not more.size:
        return x, L, np.zeros(x.size, dtype=bool)
    all_x = np.concatenate((x, more))
    order = all_x.argsort()
    all_L = np.concatenate((L, loop.response(more)))
    all_touch = np.concatenate((np.zeros(x.size, dtype=bool), touch))
    return all_x[order], all_L[order], all_touch[order]
