"""The speed that the velocity controller sees."""

from __future__ import annotations

import math

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout
from nonlinear._kernels.filters import chain

IDEAL, DIFFERENCE, TRACKING = range(3)


@kernel
def counted(value, scale):
    """Angle as counted: the count below (floor), or the angle itself without an encoder grid."""
    return float(math.floor(value * scale)) / scale if scale > 0.0 else value


@kernel
def difference(p, s, angle):
    """Difference over the last m samples; the angles lie in the state, oldest first."""
    m, at = int(p[layout.DIFFERENCE_SAMPLES]), int(p[layout.AT_ANGLES])
    speed = (angle - s[at]) / (p[layout.DIFFERENCE_SAMPLES] * p[layout.VELOCITY_PERIOD])
    for j in range(m - 1):
        s[at + j] = s[at + j + 1]
    s[at + m - 1] = angle
    return speed


@kernel
def tracking(p, s, angle):
    """Tracking loop: p = th^ + T w^, r = th - p, th^ = p + 2 w0 T r, w^ += w0^2 T r."""
    speed = s[layout.S_TRACKED_SPEED]
    foreseen = s[layout.S_TRACKED_ANGLE] + p[layout.VELOCITY_PERIOD] * speed
    r = angle - foreseen
    s[layout.S_TRACKED_ANGLE] = foreseen + p[layout.TRACKING_ANGLE] * r
    speed += p[layout.TRACKING_SPEED] * r
    s[layout.S_TRACKED_SPEED] = speed
    return speed


@kernel
def measured_speed(p, s, io, w, th):
    """Speed by the encoder's method, then its first-order filter, then the speed filters."""
    x, angle, source = w, th, int(p[layout.SPEED_SOURCE])
    if p[layout.SPEED_SENSOR] > 0.0:
        x = p[layout.RATIO] * io[layout.IN_OUTPUT_SPEED]
        angle = p[layout.RATIO] * io[layout.IN_OUTPUT]
    if source == DIFFERENCE:
        x = difference(p, s, counted(angle, p[layout.COUNTS_PER_RAD]))
    elif source == TRACKING:
        x = tracking(p, s, counted(angle, p[layout.COUNTS_PER_RAD]))
    filtered = s[layout.S_FILTERED_SPEED]
    filtered += p[layout.FILTER_COEFFICIENT] * (x - filtered)
    s[layout.S_FILTERED_SPEED] = filtered
    return chain(p, layout.SPEED_CHAIN, int(p[layout.SPEED_FILTERS]), s, layout.S_SPEED_CHAIN, filtered)
