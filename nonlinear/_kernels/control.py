"""The controllers' arithmetic, one tick at a time."""

from __future__ import annotations

import math

from nonlinear._kernels import layout
from nonlinear._kernels.compiled import inlined, scalar


@inlined
def clamp(value, limit):  # type: ignore[no-untyped-def]
    """Value held within +-limit."""
    return min(max(value, -limit), limit)


@inlined
def pi(e, integral, gain, step, limit):  # type: ignore[no-untyped-def]
    """PI with conditional integration: output, new integral, and whether the limit acts.

    ``step`` is Kp T/Tn.  The new integral is kept if the output is not clamped or v and e have opposite
    signs; otherwise the old one is, and the output is formed with it.
    """
    updated = integral + step * e
    v = gain * e + updated
    out = clamp(v, limit)
    if out == v:
        return out, updated, False
    if (v > 0.0 and e < 0.0) or (v < 0.0 and e > 0.0):
        return out, updated, True
    return clamp(gain * e + integral, limit), integral, True


@inlined
def measured_angle(p, th):  # type: ignore[no-untyped-def]
    """Angle as counted: the count below (floor), or the angle itself without an encoder grid."""
    scale = p[layout.COUNTS_PER_RAD]
    return math.floor(th * scale) / scale if scale > 0.0 else th


@inlined
def measured_speed(p, th, w, angles, place, filtered, period):  # type: ignore[no-untyped-def]
    """Speed as the velocity controller sees it (also the filter's state); ``angles`` is a ring of m."""
    x = w
    if p[layout.SPEED_SOURCE] > 0.0:
        angle = measured_angle(p, th)
        x = (angle - angles[place]) / (p[layout.DIFFERENCE_SAMPLES] * period)
        angles[place] = angle
    return filtered + p[layout.FILTER_COEFFICIENT] * (x - filtered)


@scalar
def note_limits(flags, new, k, in_window, out):  # type: ignore[no-untyped-def]
    """Note the tick of each limiter that acts for the first time, and count the ticks in the last window."""
    for j in range(4):
        if new & (1 << j):
            out[layout.OUT_LIMIT_FIRST + j] = k
        if in_window and flags & (1 << j):
            out[layout.OUT_WINDOW_LIMITS + j] += 1.0
