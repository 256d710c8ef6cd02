"""Derivatives of a measured position, and decimation without phase: the usual recipe of IDIM-LS."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.signal import butter, cheby1, filtfilt, sosfiltfilt

from actuator_lti.errors import InputError
from actuator_lti.types import Floats

LARGEST_DIRECT = 10
# a search filters the same rows a thousand times, and designing the filter takes as long as running it
butterworth, _chebyshev = (lru_cache(maxsize=64)(design) for design in (butter, cheby1))


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Filtered position with its first two derivatives, all at the record's own period."""

    position: Floats
    velocity: Floats
    acceleration: Floats

    def scaled(self, factor: float) -> Motion:
        """The motion behind a ratio."""
        return Motion(**{name: factor * values for name, values in vars(self).items()})


SEVEN_POINTS = np.array([1.0, -9.0, 45.0, 0.0, -45.0, 9.0, -1.0]) / 60.0


def central_difference(values: Floats, period_s: float, points: int = 3) -> Floats:
    """First derivative: central inside, one-sided at the two ends.

    Over three points it falls short by ``(w T)^2 / 6`` of a sine of frequency w, over seven by
    ``(w T)^6 / 140``; the outermost three samples have three points.

    >>> t = np.arange(200) * 0.1
    >>> three, seven = (central_difference(np.sin(5.0 * t), 0.1, n)[100] / 5.0 for n in (3, 7))
    >>> [round(float(slope / np.cos(5.0 * t[100])), 3) for slope in (three, seven)]
    [0.959, 1.0]
    """
    simple = np.asarray(np.gradient(values, period_s), dtype=np.float64)
    if points == 3 or len(values) < len(SEVEN_POINTS):
        return simple
    simple[3:-3] = np.convolve(values, SEVEN_POINTS, mode="valid") / period_s
    return simple


def filtered_motion(place: Floats, period_s: float, cutoff_hz: float, order: int, points: int = 3) -> Motion:
    """A position behind `low_pass`, then central differences over three or seven points twice."""
    smooth = low_pass(place, period_s, cutoff_hz=cutoff_hz, order=order)
    velocity = central_difference(smooth, period_s, points)
    acceleration = central_difference(velocity, period_s, points)
    return Motion(position=smooth, velocity=velocity, acceleration=acceleration)


def low_pass(values: Floats, period_s: float, *, cutoff_hz: float, order: int) -> Floats:
    """Butterworth forward and backward.

    The signal is extended at both ends (odd extension) by 3 * order samples, the usual padding of a filter
    of this order, or by as long as they last where ten samples make a period of the cut-off: the filter
    forgets in time, not in samples. A cut-off so low that its coefficients cancel, or that the record is
    shorter than that, is refused.
    """
    if not 0.0 < cutoff_hz < 0.5 / period_s:
        raise InputError(f"cutoff = {cutoff_hz:g} Hz: must be between 0 and {0.5 / period_s:g} Hz")
    if (2.0 * cutoff_hz * period_s) ** order < np.finfo(float).eps:
        why = f"cutoff = {cutoff_hz:g} Hz: too low for rows that are {period_s:g} s apart"
        raise InputError(f"{why}; allowed: fewer rows or a higher cut-off")
    if len(values) <= 3 * order:
        raise InputError(f"{len(values)} samples: more than {3 * order} are needed; allowed: a longer record")
    padding = round(3 * order * max(1.0, 0.1 / (cutoff_hz * period_s)))
    if len(values) <= padding:
        why = f"its filter remembers {padding} rows, and there are {len(values)}; allowed:"
        lowest = f"{lowest_cutoff_hz(len(values), period_s, order):.6g} Hz and more, or more rows"
        raise InputError(f"cutoff = {cutoff_hz:g} Hz: {why} {lowest}")
    b, a = butterworth(order, 2.0 * cutoff_hz * period_s)
    return np.asarray(filtfilt(b, a, values, padlen=padding), dtype=np.float64)


def lowest_cutoff_hz(rows: int, period_s: float, order: int) -> float:
    """The cut-off whose filter remembers as much as so many rows are."""
    return 0.3 * order / ((rows - 1) * period_s)


def decimated(columns: Floats, factor: int) -> Floats:
    """Every ``factor``-th row after a low-pass without phase, so that the last row is kept.

    Chebyshev type I of 8th order, 0.05 dB ripple, cut at 0.8 of the new Nyquist frequency, forward and
    backward with 24 samples of padding. For n rows the result has ceil(n / factor).
    """
    if factor == 1:
        return columns
    if len(columns) <= 24:
        raise InputError(f"{len(columns)} samples are too few to decimate by {factor}")
    if factor <= LARGEST_DIRECT:
        b, a = _chebyshev(8, 0.05, 0.8 / factor)
        smooth = np.asarray(filtfilt(b, a, columns, axis=0, padlen=24), dtype=np.float64)
    else:  # as one polynomial its coefficients would cancel
        sections = _chebyshev(8, 0.05, 0.8 / factor, output="sos")
        padding = min(3 * factor, len(columns) - 1)
        smooth = np.asarray(sosfiltfilt(sections, columns, axis=0, padlen=padding), dtype=np.float64)
    kept = -(-len(columns) // factor)
    first = len(columns) - factor * (kept - 1) - 1
    return smooth[first::factor]
