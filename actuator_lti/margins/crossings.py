"""Crossings of a rational loop: candidates from eigenvalues, held by a change of sign, polished by Newton."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from actuator_lti.errors import NumericalError
from actuator_lti.margins.circles import Circles, on_axis, unwarped, warped
from actuator_lti.margins.loop import Complex, Mask, RationalLoop, Real

TOUCH = 1e-9  # how near to one (gain) or to the axis (rad) a touching curve counts as touching
_POSSIBLE_TOUCH = 1e-3
_NEWTON_STEP = 1e-9
_NEWTON_STEPS = 8


@dataclass(frozen=True)
class Crossings:
    """All points at which L meets the unit circle or the real axis, inside the band (ends left out).

    Attributes
    ----------
    gain_x, gain_L, gain_touch : arrays
        Where \\|L\\| = 1, L there, and whether it only touches.
    real_x, real_L, real_touch : arrays
        The same for the real axis, positive side included.
    between_x, between_L : arrays
        One point between any two neighbours of ``real_x`` and border poles, one before and one after.
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
    possible_touch: Mask
    is_pole: Mask
    samples: Real  # one more than x

    @property
    def count(self) -> int:
        return self.x.size


def find_crossings(loop: RationalLoop, circles: Circles, border_x: Real, typical_x: float) -> Crossings:
    """Find every crossing of the unit circle and of the real axis with 0 < x < end.

    Parameters
    ----------
    loop, circles : RationalLoop, Circles
        At least one state.
    border_x : array
        Poles on the border, 0 < x < end.
    typical_x : float
        A frequency to look at where there is no candidate at all.

    Raises
    ------
    NumericalError
        The gain is one at every frequency.
    """
    gain_zeros = circles.circle(1.0, 0.0, -1.0)
    if gain_zeros is None:
        raise NumericalError("the gain of the loop is one at every frequency: it has no phase margin")
    real_zeros = circles.real_axis()
    gain = _candidates(gain_zeros, border_x, loop.sampled, typical_x)
    real = _candidates(
        np.empty(0, dtype=complex) if real_zeros is None else real_zeros, border_x, loop.sampled, typical_x
    )
    L = loop.response(np.concatenate((gain.samples, real.samples)))
    L_gain, L_real = L[: gain.samples.size], L[gain.samples.size :]
    above, upper = np.abs(L_gain) > 1.0, L_real.imag > 0.0
    if real_zeros is None:
        upper = np.zeros(L_real.size, dtype=bool)
    gain_hit = (above[1:] != above[:-1]) & ~gain.is_pole
    real_hit = (upper[1:] != upper[:-1]) & ~real.is_pole
    x, values = _polish(
        loop,
        np.concatenate((gain.x[gain_hit], real.x[real_hit])),
        np.concatenate((gain.samples[:-1][gain_hit], real.samples[:-1][real_hit])),
        np.concatenate((gain.samples[1:][gain_hit], real.samples[1:][real_hit])),
        int(np.count_nonzero(gain_hit)),
    )
    k = int(np.count_nonzero(gain_hit))
    gain_x, gain_L, gain_touch = _with_touches(loop, gain, gain_hit, x[:k], values[:k], True)
    real_x, real_L, real_touch = _with_touches(loop, real, real_hit, x[k:], values[k:], False)
    return Crossings(gain_x, gain_L, gain_touch, real_x, real_L, real_touch, real.samples, L_real)


def gain_crossings(loop: RationalLoop, circles: Circles) -> Real:
    """Only the crossings of the unit circle, 0 < x < end, points of touch left out; border poles allowed."""
    zeros = circles.circle(1.0, 0.0, -1.0)
    if zeros is None:
        return np.empty(0)
    found = _candidates(zeros, np.empty(0), loop.sampled, 1.0)
    above = np.abs(loop.response(found.samples)) > 1.0
    hit = above[1:] != above[:-1]
    k = int(np.count_nonzero(hit))
    x, values = _polish(loop, found.x[hit], found.samples[:-1][hit], found.samples[1:][hit], k)
    x, _, touch = _with_touches(loop, found, hit, x, values, True)
    return x[~touch]


def _candidates(zeros: Complex, border_x: Real, sampled: bool, typical_x: float) -> _Candidates:
    near = on_axis(zeros)
    w, touch = near.imag, np.abs(near.real) <= _POSSIBLE_TOUCH * near.imag
    pole = np.zeros(w.size, dtype=bool)
    if border_x.size:
        w = np.concatenate((w, warped(border_x, sampled)))
        pole = np.concatenate((pole, np.ones(border_x.size, dtype=bool)))
        touch = np.concatenate((touch, np.zeros(border_x.size, dtype=bool)))
        order = w.argsort()
        w, pole, touch = w[order], pole[order], touch[order]
    if not w.size:
        return _Candidates(w, touch, pole, np.array([typical_x]))
    samples = np.empty(w.size + 1)
    samples[0], samples[-1] = 0.5 * w[0], 2.0 * w[-1]
    samples[1:-1] = np.sqrt(w[:-1] * w[1:])
    return _Candidates(unwarped(w, sampled), touch, pole, unwarped(samples, sampled))


def _polish(loop: RationalLoop, x: Real, low: Real, high: Real, gains: int) -> tuple[Real, Complex]:
    """Newton on log \\|L\\| (the first ``gains`` ones) or on the phase; every root stays in its bracket."""
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
        x[k] = _bracketed(loop, float(low[k]), float(high[k]), k < gains)
        value[k] = loop.response(x[k : k + 1])[0]
    return x, value


def _function(loop: RationalLoop, x: float, gain: bool) -> float:
    L = complex(loop.response(np.array([x]))[0])
    return float(np.log(abs(L))) if gain else L.imag / abs(L)


def _bracketed(loop: RationalLoop, low: float, high: float, gain: bool) -> float:
    root = brentq(lambda x: _function(loop, x, gain), low, high, xtol=1e-300, rtol=1e-15, maxiter=300)
    return float(root)


def _with_touches(
    loop: RationalLoop, found: _Candidates, hit: Mask, x: Real, L: Complex, gain: bool
) -> tuple[Real, Complex, Mask]:
    """Add pairs of crossings that are too close for the samples, and points of touch."""
    flat = np.zeros(x.size, dtype=bool)
    if not (found.possible_touch & ~hit).any():
        return x, L, flat
    more: list[float] = []
    touch: list[bool] = []
    k = 0
    while k < found.count:
        if hit[k] or not found.possible_touch[k]:
            k += 1
            continue
        first = k
        while k + 1 < found.count and found.possible_touch[k + 1] and not hit[k + 1]:
            k += 1
        for low, high in zip(found.samples[first : k + 1], found.samples[first + 1 : k + 2], strict=True):
            _near_touch(loop, float(low), float(high), gain, more, touch)
        if k > first:
            _near_touch(loop, float(found.samples[first]), float(found.samples[k + 1]), gain, more, touch)
        k += 1
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
    elif value * side < 0.0:
        more.extend((_bracketed(loop, low, top, gain), _bracketed(loop, top, high, gain)))
        touch.extend((False, False))


def _merged(loop: RationalLoop, x: Real, L: Complex, more: Real, touch: Mask) -> tuple[Real, Complex, Mask]:
    keep = np.ones(more.size, dtype=bool)
    for k in range(more.size):
        known = np.concatenate((x, more[:k][keep[:k]]))
        keep[k] = not (np.abs(known - more[k]) <= 1e-9 * more[k]).any()
    more, touch = more[keep], touch[keep]
    if not more.size:
        return x, L, np.zeros(x.size, dtype=bool)
    all_x = np.concatenate((x, more))
    order = all_x.argsort()
    all_L = np.concatenate((L, loop.response(more)))
    all_touch = np.concatenate((np.zeros(x.size, dtype=bool), touch))
    return all_x[order], all_L[order], all_touch[order]
