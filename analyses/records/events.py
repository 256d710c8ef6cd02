"""The moments at which a motion starts and ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analyses.estimation.arrays import FloatArray


@dataclass(frozen=True)
class MotionEvents:
    """Start of a motion, and its end where the record shows it."""

    start_s: float
    stop_s: float | None


def motion_events(time_s: FloatArray, magnitude: FloatArray) -> MotionEvents | None:
    """First rise through half of the plateau, and last fall below it, by linear interpolation.

    The plateau is the 95 % point of the magnitude, its floor the 1 % point. None where there is no rise: a
    flat signal, or one that is up from the beginning.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(0.0, 10.0, 0.1)
    >>> e = motion_events(t, np.clip(t - 2.0, 0.0, 1.0))
    >>> round(e.start_s, 6), e.stop_s
    (2.5, None)
    """
    floor, plateau = np.quantile(magnitude, [0.01, 0.95])
    level = 0.5 * (floor + plateau)
    noise = 1.4826 * float(np.median(np.abs(np.diff(magnitude)))) / np.sqrt(2.0)
    if plateau - floor <= max(6.0 * noise, 1e-12 * abs(plateau)):
        return None
    up = magnitude >= level
    if up[0]:
        return None
    rise = int(np.argmax(up))
    fall = len(up) - 1 - int(np.argmax(up[::-1]))
    start = _crossing(time_s, magnitude, rise - 1, level)
    stop = None if fall == len(up) - 1 else _crossing(time_s, magnitude, fall, level)
    return MotionEvents(start, stop)


def _crossing(time_s: FloatArray, values: FloatArray, k: int, level: float) -> float:
    share = (level - values[k]) / (values[k + 1] - values[k])
    return float(time_s[k] + share * (time_s[k + 1] - time_s[k]))
