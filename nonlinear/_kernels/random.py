"""Seeded noise whose whole state is two numbers a stream: the same in every language.

L'Ecuyer's combined multiplicative generator (1988): all products stay below 2^53, so floats hold them
exactly.
"""

from __future__ import annotations

import math

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout

M_1, A_1 = 2147483563.0, 40014.0
M_2, A_2 = 2147483399.0, 40692.0
TURN = 2.0 * math.pi
WARM_UP = 16


@kernel
def rest(x, m):
    """Remainder of two whole numbers held in floats, x >= 0, below 2^53."""
    r = x - math.floor(x / m) * m
    if r < 0.0:
        r += m
    return r - m if r >= m else r


@kernel
def uniform(s, at):
    """Next number of the stream at ``s[at]``, above 0 and below 1."""
    s[at] = rest(A_1 * s[at], M_1)
    s[at + 1] = rest(A_2 * s[at + 1], M_2)
    z = s[at] - s[at + 1]
    if z < 1.0:
        z += M_1 - 1.0
    return z / M_1


@kernel
def normal(s, stream):
    """Next number of a stream with mean 0 and standard deviation 1 (Box and Muller)."""
    at = layout.S_NOISE + 2 * stream
    radius = math.sqrt(-2.0 * math.log(uniform(s, at)))
    return radius * math.cos(TURN * uniform(s, at))


@kernel
def seed_streams(s, seed):
    """Start every stream; another seed starts all of them elsewhere."""
    for stream in range(4):
        at = layout.S_NOISE + 2 * stream
        s[at] = 1.0 + rest(4.0 * seed + stream, M_1 - 1.0)
        s[at + 1] = 1.0 + rest(12345.0 + 7919.0 * stream + seed, M_2 - 1.0)
        for _ in range(WARM_UP):
            uniform(s, at)
