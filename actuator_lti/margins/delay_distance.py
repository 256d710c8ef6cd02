"""Smallest distance of the curve to -1 under delay, by splitting what a bound cannot exclude."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import minimize_scalar

from actuator_lti.errors import NumericalError
from actuator_lti.margins.delay_form import DelayForm, Intervals, border_values, evaluate_intervals
from actuator_lti.margins.delay_setting import Setting, dc_value, intervals_of, setting_of
from actuator_lti.margins.distances import FAR, Distance, complementary, inverse, modulus
from actuator_lti.margins.loop import Complex, Real
from actuator_lti.margins.sweep import variation

_FINEST = 1e-4  # how much lower the smallest distance may be, relative, before it is polished
_MOST = 400_000


def delayed_extreme(form: DelayForm, distance_of: Distance) -> tuple[float, float]:
    """Smallest value of a distance over the axis, and where (x)."""
    setting = setting_of(form, None)
    return smallest_distance(setting, intervals_of(setting), distance_of)


def smallest_distance(setting: Setting, intervals: Intervals, distance_of: Distance) -> tuple[float, float]:
    """Smallest value of a distance and its x, from intervals that cover the axis.

    Intervals in which the bound allows less than 0.9999 of the best so far are split; the best is polished.

    Raises
    ------
    NumericalError
        Too many intervals would be needed.
    """
    form, count = setting.form, 0
    ends_x, ends_L = _end_values(setting)
    at_ends = distance_of(ends_L)
    best, place, half = float(at_ends.min()), float(ends_x[int(at_ends.argmin())]), 0.0
    while True:
        distance = distance_of(intervals.L)
        k = int(distance.argmin())
        if distance[k] < best * (1.0 - 1e-12):
            best, place, half = float(distance[k]), float(intervals.x[k]), float(intervals.half[k])
        again = _lower_bound(distance_of, intervals, variation(form, intervals)) < best * (1.0 - _FINEST)
        count += int(np.count_nonzero(again))
        if best < 1e-9 or not again.any():
            return _polished(form, distance_of, best, place, half)
        if count > _MOST:
            raise NumericalError("the smallest distance to -1 was not settled: too many turns of the delay")
        low, high = (intervals.x - intervals.half)[again], (intervals.x + intervals.half)[again]
        middle = 0.5 * (low + high)
        intervals = evaluate_intervals(form, np.concatenate((low, middle)), np.concatenate((middle, high)))


def _polished(
    form: DelayForm, distance_of: Distance, best: float, place: float, half: float
) -> tuple[float, float]:
    if not half:
        return best, place

    def at(x: float) -> float:
        return float(distance_of(border_values(form, np.array([x])))[0])

    low, high = max(place - 4.0 * half, 0.5 * place), place + 4.0 * half
    if form.sampled:
        high = min(high, math.pi)
    minimum = minimize_scalar(at, bounds=(low, high), method="bounded", options={"xatol": 1e-9 * high})
    return (float(minimum.fun), float(minimum.x)) if minimum.fun < best else (best, place)


def _end_values(setting: Setting) -> tuple[list[float], Complex]:
    x: list[float] = [0.0]
    L: list[complex] = [FAR if setting.order else dc_value(setting)]
    if setting.form.sampled:
        x.append(math.pi)
        L.append(complex(border_values(setting.form, np.array([math.pi]))[0]))
    else:
        x.append(math.inf)
        L.append(0.0)
    return x, np.array(L, dtype=complex)


def _lower_bound(distance_of: Distance, intervals: Intervals, R: Real) -> Real:
    """What a distance cannot fall below inside each interval: by the disk about L, or by its gain."""
    size = np.abs(intervals.L)
    least, most = np.maximum(size - intervals.spread, 0.0), size + intervals.spread
    distance, away = distance_of(intervals.L), np.abs(1.0 - intervals.L)
    with np.errstate(divide="ignore", invalid="ignore"):
        if distance_of is inverse:
            return 1.0 / most
        if distance_of is complementary:
            by_disk = np.where(size > R, distance - R / (size * (size - R)), -np.inf)
            return np.maximum(by_disk, np.maximum(1.0 / most - 1.0, 1.0 - 1.0 / least))
        by_gain = np.maximum(1.0 - most, least - 1.0)
        if distance_of is modulus:
            return np.maximum(distance - R, by_gain)
        by_disk = np.where(away > R, distance - 4.0 * R / (away * (away - R)), -np.inf)
        # about L = 1, where the disk's has its pole: a servo whose gain at rest is one starts there
        by_disk = np.maximum(by_disk, 2.0 * (np.abs(1.0 + intervals.L) - R) / (away + R))
        by_gain = np.maximum(2.0 * (1.0 - most) / (1.0 + most), 2.0 * (least - 1.0) / (least + 1.0))
        return np.maximum(by_disk, by_gain)
