"""An instrument in the loop: adds a signal, multiplies the gain, delays, and notes before and after."""

from __future__ import annotations

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout

PROBE_U = layout.PROBES + layout.POINT_VOLTAGE * layout.PROBE_SIZE
PROBE_I = layout.PROBES + layout.POINT_CURRENT * layout.PROBE_SIZE
PROBE_W = layout.PROBES + layout.POINT_SPEED * layout.PROBE_SIZE
PROBE_Y = layout.PROBES + layout.POINT_OUTPUT * layout.PROBE_SIZE


@kernel
def probe(p, s, io, point, value):
    """Signal after the probe at ``point``: gain times the delayed value plus the injected signal.

    The past values lie in a ring of the state, one for each point.
    """
    at = layout.PROBES + point * layout.PROBE_SIZE
    taps = int(p[at + layout.PROBE_TAPS])
    passed = value
    if taps > 0:
        size = int(p[layout.PROBE_RING])
        ring = int(p[layout.AT_PROBES]) + point * size
        place = int(s[layout.S_PROBE_PLACES + point])
        s[ring + place] = value
        s[layout.S_PROBE_PLACES + point] = float(place + 1 if place + 1 < size else 0)
        read = place - int(p[at + layout.PROBE_DELAY])
        if read < 0:
            read += size
        passed = 0.0
        for j in range(taps):
            passed += p[at + layout.PROBE_TAP + j] * s[ring + read]
            read = read - 1 if read > 0 else size - 1
    return p[at + layout.PROBE_GAIN] * passed + io[layout.IN_PROBE + point]


@kernel
def fill_ring(p, s, point, value):
    """Take every past value at a point as ``value``."""
    size = int(p[layout.PROBE_RING])
    ring = int(p[layout.AT_PROBES]) + point * size
    for j in range(size):
        s[ring + j] = value
