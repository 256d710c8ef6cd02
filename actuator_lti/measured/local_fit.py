"""Measured points, each by a straight line through as many about it as the data allow: noise averages out.

Log L over log frequency. A line through n points leaves about 1/sqrt(n) of their noise, and errs by what
the curvature makes of it: judged, as between the points, by three times what the parabolas nearby say. The
window in which both are least together is taken, point by point; the one that holds only the point itself is
among them. Points are taken as independent.
"""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from actuator_lti.measured.bounds import CURVATURE, bend, unresolved_intervals
from actuator_lti.measured.response import CONFIDENCE, GAUSSIAN
from actuator_lti.types import Complex, Ints, Mask, Real

_LINEAR = 0.5  # of the size: noise up to this is the same in log L


class _Fit(NamedTuple):
    """At each point: value, its radius and the half-width of the strip about it."""

    value: Complex
    radius: Real
    width: Real


def averaged(omega: Real, L: Complex, radius: Real) -> tuple[Complex, Real]:
    """L and radius at the same frequencies with less noise; (m,) each, rising frequencies."""
    ratio = radius / np.abs(L)
    if omega.size < 5 or not ratio.any():
        return L, radius
    u = np.log(omega)
    y = np.log(np.abs(L)) + 1j * np.unwrap(np.angle(L))
    apart = unresolved_intervals(L, radius) | (ratio[1:] >= _LINEAR) | (ratio[:-1] >= _LINEAR)
    off = np.concatenate(([0.0], np.hypot(bend(u, y.real), bend(u, y.imag)), [0.0]))  # L from its chords
    best = _Fit(y, ratio, ratio + np.maximum(off[:-1], off[1:]))
    half = 2
    while 2 * half < omega.size:
        other = _fitted(u, y, ratio, apart, half)
        best = _Fit(*(np.where(other.width < best.width, b, a) for a, b in zip(best, other, strict=True)))
        half *= 2
    value = np.exp(best.value)
    changed = best.value != y
    return np.where(changed, value, L), np.where(changed, best.radius * np.abs(value), radius)


def _fitted(u: Real, y: Complex, ratio: Real, apart: Mask, half: int) -> _Fit:
    """Fits over windows of up to ``half`` points on either side; every quarter of one, straight between."""
    every = np.arange(u.size)
    at = np.unique(np.append(every[:: max(half // 4, 1)], every[-1]))
    value, radius, bent = _lines(u, y, ratio, apart, at, half)
    left = np.searchsorted(at, every, side="right") - 1
    right = np.minimum(left + (at[left] < every), at.size - 1)
    between = np.interp(u, u[at], value.real) + 1j * np.interp(u, u[at], value.imag)
    radius, bent = (np.maximum(one[left], one[right]) for one in (radius, bent))
    gap = np.diff(u, prepend=u[0], append=u[-1])
    return _Fit(between, radius, radius + CURVATURE * bent * np.maximum(gap[1:], gap[:-1]) ** 2 / 8.0)


def _lines(u: Real, y: Complex, ratio: Real, apart: Mask, at: Ints, half: int) -> tuple[Complex, Real, Real]:
    """Value, radius and curvature at some points: of a parabola over the window about each, and of a line
    over the inner half of it, so that the curvature is known better than what it makes of the line.

    The radius is infinite where the window holds a resonance between two points, a value lost in noise, or
    values farther off their parabola than their noise in 99 of 100 cases.
    """
    from scipy.special import gammaincinv  # takes longer to load than all else that most commands need

    offset = np.arange(-half, half + 1)
    window = at[:, None] + offset
    there = (window >= 0) & (window < u.size)
    window = np.clip(window, 0, u.size - 1)
    values, noise = np.where(there, y[window], 0.0), np.where(there, ratio[window], 0.0)
    count = there.sum(axis=1, keepdims=True)
    x = np.where(there, u[window] - u[at, None], 0.0)
    # polynomials of degree 1 and 2, orthogonal over each window
    middle = x.sum(axis=1, keepdims=True) / count
    tilt = np.where(there, x - middle, 0.0)
    tilt2 = _dot(tilt, tilt)
    bow = np.where(there, tilt**2 - tilt2 / count - _dot(tilt**2, tilt) / tilt2 * tilt, 0.0)
    mean, slope = values.sum(axis=1, keepdims=True) / count, _dot(tilt, values) / tilt2
    curve = _dot(bow, values) / np.maximum(_dot(bow, bow), np.finfo(float).tiny)
    weight = _line_weights(x, there & (np.abs(offset) <= half // 2))
    rest = np.where(there, values - mean - slope * tilt - curve * bow, 0.0)
    bent = 2.0 * sliding_window_view(np.pad(np.abs(curve[:, 0]), 4), 9).max(axis=1)  # half a window around
    off = CURVATURE * bent * np.abs(_dot(weight, x**2)[:, 0]) / 2.0
    radius = np.sqrt((weight**2 * noise**2).sum(axis=1)) + off
    crossed = np.concatenate(([0], np.cumsum(apart)))
    torn = crossed[window[:, -1]] > crossed[window[:, 0]]
    # sum of squares of complex errors over the squared radius of one in 99 of 100: half a chi-square
    most = gammaincinv(np.maximum(count[:, 0] - 3.0, 1.0), CONFIDENCE) / GAUSSIAN**2
    most *= (noise**2).sum(axis=1) / count[:, 0]
    wrong = torn | ((np.abs(rest) ** 2).sum(axis=1) > most)
    return _dot(weight, values)[:, 0], np.where(wrong, np.inf, radius), bent


def _line_weights(x: Real, there: Mask) -> Real:
    """Of each value in the least-squares line's at x = 0."""
    count = there.sum(axis=1, keepdims=True)
    middle = np.where(there, x, 0.0).sum(axis=1, keepdims=True) / count
    tilt = np.where(there, x - middle, 0.0)
    return np.where(there, 1.0 / count - middle * tilt / _dot(tilt, tilt), 0.0)


def _dot(one: Real, other: Complex) -> Complex:
    return np.asarray((one * other).sum(axis=1, keepdims=True))
