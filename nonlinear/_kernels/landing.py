"""When a slipping speed comes down to zero: bracketed between extremes, then refined to rounding."""

from __future__ import annotations

import math

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout
from nonlinear._kernels.modal import COMPLEX, derivative, first_extremum, slip_at

NONE_IN_SEGMENT = -1.0
NEVER_LEFT = -2.0
ITERATIONS = 200


@kernel
def first_landing(p, s, at, reverse, d, i, w, th, u, T, dt):
    """First time in (0, dt] at which s w falls to zero.

    ``NONE_IN_SEGMENT`` if it stays positive; ``NEVER_LEFT`` if a speed that begins at zero has not become
    positive by dt (a departure lost in rounding).  A start at zero is not a landing.
    """
    up = d * w > 0.0
    begin = 0.0
    gap = 0.5 * math.pi / p[at + layout.ROOT] if int(p[at + layout.KIND]) == COMPLEX else 0.0
    end = min(first_extremum(p, at, i, w, u, T, 0.0), dt)
    while True:
        if end > 0.0:
            _, w_end, _ = slip_at(p, s, at, reverse, end, i, w, th, u, T)
            if d * w_end > 0.0:
                up = True
            elif up:
                return refine(p, s, at, reverse, d, i, w, th, u, T, begin, end)
        if end >= dt:
            return NONE_IN_SEGMENT if up else NEVER_LEFT
        begin = end
        end = min(first_extremum(p, at, i, w, u, T, begin + gap), dt)


@kernel
def refine(p, s, at, reverse, d, i, w, th, u, T, begin, end):
    """Root of w in a bracket where s w falls through zero once: Newton inside bisection."""
    low, high = begin, end
    t = 0.5 * (low + high)
    for _ in range(ITERATIONS):
        i_t, w_t, _ = slip_at(p, s, at, reverse, t, i, w, th, u, T)
        if d * w_t > 0.0:
            low = t
        else:
            high = t
        if w_t == 0.0:
            return t
        _, slope = derivative(p, at, i_t, w_t, u, T)
        step = -w_t / slope if slope != 0.0 else 0.0
        following = t + step
        if not (low < following < high):
            following = 0.5 * (low + high)
        if abs(following - t) <= 2.3e-16 * end or high - low <= 2.3e-16 * end:
            return following
        t = following
    return t
