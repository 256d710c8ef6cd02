"""An instrument in the loop: adds a signal, multiplies the gain, delays, and notes before and after."""

from __future__ import annotations

from nonlinear._kernels import layout
from nonlinear._kernels.compiled import inlined, kernel
from nonlinear._kernels.signals import signal


@inlined
def probe(row, point, tables, k, period, value, memory, position):  # type: ignore[no-untyped-def]
    """Signal after the probe at ``point``: gain times the delayed value plus the injected signal.

    ``memory[point]`` is a ring of past values, ``position[point]`` its next place.
    """
    at = layout.PROBES + point * layout.PROBE_SIZE
    taps = int(row[at + layout.PROBE_TAPS])
    passed = value
    if taps > 0:
        size = memory.shape[1]
        place = position[point]
        memory[point, place] = value
        position[point] = place + 1 if place + 1 < size else 0
        read = place - int(row[at + layout.PROBE_DELAY])
        if read < 0:
            read += size
        passed = 0.0
        for j in range(taps):
            passed += row[at + layout.PROBE_TAP + j] * memory[point, read]
            read = read - 1 if read > 0 else size - 1
    return row[at + layout.PROBE_GAIN] * passed + signal(row, at + layout.PROBE_SIGNAL, tables, k, period)


@kernel
def memory_size(row):  # type: ignore[no-untyped-def]
    """Length of the ring that the longest delay needs."""
    longest = 0
    for point in range(4):
        longest = max(longest, int(row[layout.PROBES + point * layout.PROBE_SIZE + layout.PROBE_DELAY]))
    return longest + layout.MAX_TAPS + 1
