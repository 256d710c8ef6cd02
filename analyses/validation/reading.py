"""Figures read off a measured curve, each with the error that the reading itself has.

A figure is read twice, from a polynomial through more and through fewer of the nearest points: what differs
is the error of interpolation.  The error of the points adds to it, through the slope of the curve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Curve = Callable[[float], float]
NEAREST = 6  # points of the interpolating polynomial
FEWER = 4  # points of the one that it is compared with
SAME = 1e-7  # of log f: points nearer to each other count as one
STEP = 0.1  # of the distance between two points, for slopes and curvatures of the polynomial


@dataclass(frozen=True)
class Reading:
    """A figure and its own error, in the same unit; ``value`` None where the curve has no such figure."""

    value: float | None
    error: float = 0.0


NOTHING = Reading(None)


def first_fall(frequency_hz: Floats, values: Floats, level: float, spread: float = 0.0) -> Reading:
    """Frequency at which values first fall below a level.

    Nothing if never in the range, or if the point before was not measured (not finite).

    Parameters
    ----------
    spread : float
        Error of the values, in their unit.
    """
    f, v = distinct(frequency_hz, values)
    below = v < level
    k = int(np.argmax(below))
    if not below[k] or k == 0 or not np.isfinite(v[k - 1]):
        return NOTHING
    return crossing(f, v, k - 1, level, spread)


def crossing(frequency_hz: Floats, values: Floats, k: int, level: float, spread: float = 0.0) -> Reading:
    """Where the curve passes a level between points k and k + 1, both measured and apart."""
    from scipy.optimize import brentq

    a, b = np.log(frequency_hz[k]), np.log(frequency_hz[k + 1])
    result = []
    for points in (NEAREST, FEWER):
        curve = local(frequency_hz, values - level, k, points)
        result.append(float(brentq(curve, a, b, xtol=1e-13)))
    x = result[0]
    slope = _slope(local(frequency_hz, values, k), x, b - a)
    by_points = spread / abs(slope) if slope else np.inf
    hertz = float(np.exp(x))
    return Reading(hertz, hertz * (abs(result[0] - result[1]) + min(by_points, b - a)))


def maximum(frequency_hz: Floats, values: Floats, spread: float = 0.0) -> tuple[Reading, Reading]:
    """Largest value between the points, and where; ``spread`` is the relative error of the values."""
    frequency_hz, values = distinct(frequency_hz, values)
    k = int(np.argmax(np.where(np.isfinite(values), values, -np.inf)))
    inside = 0 < k < values.size - 1 and np.isfinite(values[k - 1 : k + 2]).all()
    if not inside:
        value, hertz = float(values[k]), float(frequency_hz[k])
        return Reading(value, spread * abs(value)), Reading(hertz, 0.0)
    ends = (float(np.log(frequency_hz[k - 1])), float(np.log(frequency_hz[k + 1])))
    (x, top), (x2, top2) = (_top(local(frequency_hz, values, k, n), ends) for n in (NEAREST, FEWER))
    error = abs(top - top2) + spread * abs(top)
    bend = abs(_bend(local(frequency_hz, values, k), x, ends[1] - ends[0]))
    flat = sqrt(2.0 * error / bend) if bend > 0.0 else np.inf  # so far off, a top is lower by its error
    hertz = float(np.exp(x))
    return Reading(top, error), Reading(hertz, hertz * (abs(x - x2) + min(flat, ends[1] - ends[0])))


def _top(curve: Curve, ends: tuple[float, float]) -> tuple[float, float]:
    from scipy.optimize import minimize_scalar

    minimum = minimize_scalar(lambda x: -curve(x), bounds=ends, method="bounded", options={"xatol": 1e-9})
    return float(minimum.x), -float(minimum.fun)


def _slope(curve: Curve, x: float, apart: float) -> float:
    h = STEP * apart
    return (curve(x + h) - curve(x - h)) / (2.0 * h)


def _bend(curve: Curve, x: float, apart: float) -> float:
    h = STEP * apart
    return (curve(x + h) - 2.0 * curve(x) + curve(x - h)) / h**2


def value_at(frequency_hz: Floats, values: Floats, k: int, at: Reading, spread: float) -> Reading:
    """The curve near point k at a frequency that has an error itself."""
    assert at.value is not None
    x = float(np.log(at.value))
    curve, other = (local(frequency_hz, values, k, n) for n in (NEAREST, FEWER))
    apart = float(np.log(frequency_hz[k + 1] / frequency_hz[k]))
    error = abs(_slope(curve, x, apart)) * at.error / at.value + abs(curve(x) - other(x)) + spread
    return Reading(curve(x), error)


def distinct(frequency_hz: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Points without those that lie on the one before."""
    apart = np.concatenate([[True], np.diff(np.log(frequency_hz)) > SAME])
    return frequency_hz[apart], values[apart]


def local(frequency_hz: Floats, values: Floats, k: int, points: int = NEAREST) -> Curve:
    """Polynomial in log f through the points nearest to k; exact at the points."""
    from scipy.interpolate import BarycentricInterpolator

    x = np.log(frequency_hz)
    good = np.flatnonzero(np.isfinite(values) & np.concatenate([[True], np.diff(x) > SAME]))
    order = np.argsort(np.abs(x[good] - 0.5 * (x[k] + x[min(k + 1, x.size - 1)])), kind="stable")
    near = np.sort(good[order[:points]])
    curve = BarycentricInterpolator(x[near], values[near])
    return lambda at_x: float(curve(at_x))
