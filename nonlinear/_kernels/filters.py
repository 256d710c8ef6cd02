"""Chains of sections of second order."""

from __future__ import annotations

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout


@kernel
def chain(p, at, count, s, to, x):
    """Pass x through ``count`` sections (direct form II transposed).

    Coefficients b0, b1, b2, a1, a2 of each section begin at ``p[at]``, its two states at ``s[to]``.
    """
    for n in range(count):
        o, q = at + n * layout.SECTION, to + 2 * n
        y = p[o] * x + s[q]
        s[q] = p[o + 1] * x - p[o + 3] * y + s[q + 1]
        s[q + 1] = p[o + 2] * x - p[o + 4] * y
        x = y
    return x


@kernel
def settle(p, at, count, s, to, x):
    """Set the states of a chain to those of a constant input x; returns its output."""
    for n in range(count):
        o, q = at + n * layout.SECTION, to + 2 * n
        below = 1.0 + p[o + 3] + p[o + 4]
        y = (p[o] + p[o + 1] + p[o + 2]) / below * x if below != 0.0 else 0.0
        s[q + 1] = p[o + 2] * x - p[o + 4] * y
        s[q] = p[o + 1] * x - p[o + 3] * y + s[q + 1]
        x = y
    return x
