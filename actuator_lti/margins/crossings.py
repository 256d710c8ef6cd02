"""Crossings of a rational loop: candidates from eigenvalues, held by a change of sign, polished by Newton."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from actuator_lti.margins.level_crossings import LevelCrossings, on_axis, unwarped, warped
from actuator_lti.margins.loop import Complex, Mask, RationalLoop, Real
from actuator_lti.margins.trust import Doubtful

_POSSIBLE_TOUCH = 1e-3
_NEWTON_STEP = 1e-9
_NEWTON_STEPS = 8
_SAME = 1e-8
_NEAR_LINE = 0.1  # |log |L||, or the sine of the phase
_FOUND = 1e-4  # relative: how far an eigenvalue may be from the crossing that it stands for


@dataclass(frozen=True)
class Crossings:
    """All points at which L meets the unit circle or the real axis, inside the band (ends left out).

    Attributes
    ----------
    gain_x, gain_L : arrays
        Where |L| = 1, and L there.
    real_x, real_L : arrays
        The same for the real axis, positive side included.
    between_x, between_L : arrays
        Points in order, with at least one between any two neighbours of ``real_x``, one before and one after.
    """

    gain_x: Real
    gain_L: Complex
    real_x: Real
    real_L: Complex
    between_x: Real
    between_L: Complex


@dataclass(frozen=True)
class _Candidates:
    x: Real  # sorted
    off_axis: Real  # distance of the candidate to the border of stability over its frequency
    samples: Real  # one more than x


def find_crossings(loop: RationalLoop, levels: LevelCrossings, typical_x: Real) -> Crossings:
    """Find every crossing of the unit circle and of the real axis with 0 < x < end.

    Parameters
    ----------
    loop, levels : RationalLoop, LevelCrossings
        At least one state, no pole on the border but at zero frequency.
    typical_x : array
        Further frequencies at which to look at the signs.

    Raises
    ------
    Doubtful
        Changes of sign and eigenvalues do not tell the same crossings.
    """
    gain_zeros, real_zeros = levels.circle(1.0, 0.0, -1.0), levels.real_axis()
    if gain_zeros is None or real_zeros is None:
        raise Doubtful("the gain is one, or the phase zero, at every frequency")
    gain = _candidates(gain_zeros, loop.in_z)
    real = _candidates(real_zeros, loop.in_z)
    x = np.concatenate((gain.samples, real.samples, typical_x))
    x.sort()
    L = loop.response(x)
    if not np.isfinite(L).all():
        raise Doubtful("the response overflows")
    gain_hit = np.flatnonzero(_changes(np.abs(L) > 1.0))
    real_hit = np.flatnonzero(_changes(L.imag > 0.0))
    both = np.concatenate((gain_hit, real_hit))
    start = np.concatenate((_start(gain, x, gain_hit), _start(real, x, real_hit)))
    k = gain_hit.size
    root, value = _polish(loop, start, x[both], x[both + 1], k)
    _told_twice(loop, gain, root[:k], True)
    _told_twice(loop, real, root[k:], False)
    return Crossings(root[:k], value[:k], root[k:], value[k:], x, L)


def gain_crossings(loop: RationalLoop, levels: LevelCrossings) -> Real:
    """Only the crossings of the unit circle, 0 < x < end, points of touch left out; no border poles."""
    try:
        zeros = levels.circle(1.0, 0.0, -1.0)
        if zeros is None:
            return np.empty(0)
        result = _candidates(zeros, loop.in_z)
        if not result.x.size:
            return np.empty(0)
        x = result.samples
        hit = np.flatnonzero(_changes(np.abs(loop.response(x)) > 1.0))
        root, _ = _polish(loop, result.x[hit], x[hit], x[hit + 1], hit.size)
        _told_twice(loop, result, root, True)
    except (Doubtful, np.linalg.LinAlgError):
        return _exact_gain_crossings(loop)
    return root


def _exact_gain_crossings(loop: RationalLoop) -> Real:
    from actuator_lti.margins.exact_findings import findings  # python-flint only where it is needed
    from actuator_lti.margins.exact_loop import exact_loop

    w = np.array([c.w for c in findings(exact_loop(loop.given())).gains if not c.touch])
    return unwarped(w, loop.in_z)


def _changes(side: Mask) -> Mask:
    return side[1:] != side[:-1]


def _start(candidates: _Candidates, x: Real, hit: NDArray[np.intp]) -> Real:
    """Where Newton starts in each interval [x[k], x[k + 1]]: its candidate, or its middle."""
    low, high = x[hit], x[hit + 1]
    if not candidates.x.size:
        return np.sqrt(low * high)
    at = candidates.x[np.minimum(np.searchsorted(candidates.x, low), candidates.x.size - 1)]
    return np.where((at > low) & (at < high), at, np.sqrt(low * high))


def _candidates(zeros: Complex, in_z: bool) -> _Candidates:
    near = on_axis(zeros)
    w, off_axis = near.imag, np.abs(near.real) / near.imag
    if (
        w.size > 1 and (w[1:] - w[:-1] <= _SAME * w[1:]).any()
    ):  # one candidate twice, or a pair: looked at as one
        first = np.flatnonzero(np.concatenate(([True], w[1:] - w[:-1] > _SAME * w[1:])))
        w, off_axis = w[first], np.minimum.reduceat(off_axis, first)
    samples = np.empty(w.size + 1 if w.size else 0)
    if w.size:
        samples[0], samples[-1] = 0.5 * w[0], 2.0 * w[-1]
        samples[1:-1] = np.sqrt(w[:-1] * w[1:])
    return _Candidates(unwarped(w, in_z), off_axis, unwarped(samples, in_z))


def _told_twice(loop: RationalLoop, candidates: _Candidates, root: Real, gain: bool) -> None:
    """Every crossing has its eigenvalue; every eigenvalue on the axis and near the line has its crossing."""
    w, at = warped(root, loop.in_z), warped(candidates.x, loop.in_z)
    lonely = _apart(w, at).any()
    open_x = candidates.x[(candidates.off_axis <= _POSSIBLE_TOUCH) & _apart(at, w)]
    if open_x.size:  # an eigenvalue of rounding, as those at infinity are, lies where L is not near the line
        L = loop.response(open_x)
        away = np.abs(np.log(np.abs(L))) if gain else np.abs(L.imag) / np.abs(L)
        lonely |= not (away > _NEAR_LINE).all()
    if lonely:
        raise Doubtful("a crossing and its eigenvalue do not agree: a touch, or too wide a range")


def _apart(these: Real, those: Real) -> Mask:
    if not those.size:
        return np.ones(these.size, dtype=bool)
    apart: Mask = np.abs(these[:, None] - those).min(axis=1) > _FOUND * these
    return apart


def _polish(loop: RationalLoop, x: Real, low: Real, high: Real, gains: int) -> tuple[Real, Complex]:
    """Newton on log |L| (the first ``gains`` ones) or on the phase; every root stays in its bracket."""
    if not x.size:
        return x, np.empty(0, dtype=complex)
    failed = np.zeros(x.size, dtype=bool)
    start = x
    for _ in range(_NEWTON_STEPS):
        L, slope = loop.response_and_slope(x)
        step = _newton_step(L, slope, gains)
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
    if failed.any():
        value, slope = loop.response_and_slope(x)
    if not loop.in_z:
        return x, value
    value = loop.sharp_response(
        x
    )  # near z = 1 the last digits of z are all there is: one more step with them
    step = _newton_step(value, slope, gains)
    return x - step, value - slope * step


def _newton_step(L: Complex, slope: Complex, gains: int) -> Real:
    rate = slope / L
    step = np.empty(L.size)
    step[:gains] = np.log(np.abs(L[:gains])) / rate.real[:gains]
    turned = L[gains:] * np.sign(L.real[gains:])
    step[gains:] = np.arctan2(turned.imag, turned.real) / rate.imag[gains:]
    return step


def _function(loop: RationalLoop, x: float, gain: bool) -> float:
    L = complex(loop.response(np.array([x]))[0])
    return float(np.log(abs(L))) if gain else L.imag / abs(L)


def _bracketed(loop: RationalLoop, low: float, high: float, gain: bool) -> float:
    ends = _function(loop, low, gain), _function(loop, high, gain)
    if not ends[0] * ends[1] < 0.0:
        raise Doubtful("a change of sign is within rounding")
    root = brentq(lambda x: _function(loop, x, gain), low, high, xtol=1e-300, rtol=1e-15, maxiter=300)
    return float(root)
