"""The memory of the overload protection, ``x += a ((i/i_cont)^2 - x)`` a tick, where nothing else moves."""

from __future__ import annotations

from math import log, log1p

import numpy as np
import numpy.typing as npt

from nonlinear._kernels import layout as at
from nonlinear.runs.running import Running

Floats = npt.NDArray[np.float64]


def stays_overloaded(drive: Running) -> bool:
    """Whether the overload memory, on its way to what the current makes of it, stays where it limits."""
    p, s = drive.p, drive.s
    if s[at.S_OVERLOADED] == 0.0:
        return False
    reached = (s[at.S_CURRENT] / p[at.CONTINUOUS_CURRENT]) ** 2
    return bool(min(reached, s[at.S_OVERLOAD]) >= p[at.OVERLOAD_RELEASE])


def ticks_until_it_acts(p: Floats, s: Floats) -> int:
    """Ticks after which the memory under this current trips or lets go; 0 where it does not get there.

    The distance to ``(i/i_cont)^2`` falls by ``1 - a`` a tick.
    """
    level = p[at.OVERLOAD_RELEASE] if s[at.S_OVERLOADED] > 0.0 else 1.0
    reached = (s[at.S_CURRENT] / p[at.CONTINUOUS_CURRENT]) ** 2
    way, left = reached - s[at.S_OVERLOAD], reached - level
    if way * left <= 0.0 or abs(left) >= abs(way):
        return 0
    return int(log(left / way) / log1p(-p[at.OVERLOAD_RATE]))


def overload(p: Floats, s: Floats, current_A: float, ticks: int) -> float:
    """The memory after ticks in which the current grows evenly from that of ``s``."""
    if ticks == 0:
        return float(s[at.S_OVERLOAD])
    a, size = p[at.OVERLOAD_RATE], p[at.CONTINUOUS_CURRENT]
    start, slope = s[at.S_CURRENT] / size, (current_A - s[at.S_CURRENT]) / (ticks * size)
    C, B = slope**2, 2.0 * slope * (start - slope / a)
    A = start**2 - (B + C) / a
    return float(A + B * ticks + C * ticks**2 + (1.0 - a) ** ticks * (s[at.S_OVERLOAD] - A))
