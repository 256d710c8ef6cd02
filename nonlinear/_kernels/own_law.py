"""A law of one's own (model.md section 10): v = gain (C x + D e), x+ = A x + B e + L (u - v)."""

from __future__ import annotations

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout


@kernel
def own_output(p, s, io, command, error, angle, output):
    """The law's output; leaves its inputs, in the order of `LAW_INPUTS`, in the work space."""
    e, x = int(p[layout.AT_WORK]), int(p[layout.AT_OWN])
    s[e], s[e + 1], s[e + 2] = command, error, s[layout.S_MEASURED_SPEED]
    s[e + 3], s[e + 4] = angle, io[layout.IN_CURRENT]
    s[e + 5], s[e + 6] = output, io[layout.IN_OUTPUT_SPEED]
    v = 0.0
    for j in range(int(p[layout.OWN_STATES])):
        v += p[layout.OWN_C + j] * s[x + j]
    for j in range(layout.OWN_INPUTS):
        v += p[layout.OWN_D + j] * s[e + j]
    return p[layout.OWN_GAIN] * v


@kernel
def own_states(p, s, excess):
    """Step the states on, after `own_output`; ``excess`` is u - v."""
    n, e, x = int(p[layout.OWN_STATES]), int(p[layout.AT_WORK]), int(p[layout.AT_OWN])
    to = e + layout.OWN_INPUTS
    for k in range(n):
        value = p[layout.OWN_L + k] * excess
        a, b = layout.OWN_A + k * layout.MOST_STATES, layout.OWN_B + k * layout.OWN_INPUTS
        for j in range(n):
            value += p[a + j] * s[x + j]
        for j in range(layout.OWN_INPUTS):
            value += p[b + j] * s[e + j]
        s[to + k] = value
    for k in range(n):
        s[x + k] = s[to + k]
