"""The drive between two ticks: what a host sees whose communication points lie elsewhere."""

from __future__ import annotations

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout
from nonlinear._kernels.motion import closely, count_events, hold, quick
from nonlinear._kernels.start import derive
from nonlinear._kernels.tick import decide


@kernel
def part_of_tick(p, q, s, io, tau):  # type: ignore[no-untyped-def]
    """Sense and control at t_k and move to t_k + tau, 0 < tau < Ts; returns a status.

    ``s`` is a copy of the state at t_k that no tick goes on from.  ``q``, a copy of derived ``p``, becomes
    the plant over a tick of tau seconds, exact as over a whole one: the voltage changes at t_k + f in both.
    """
    decide(p, s, io)
    hold(p, s, io)
    q[layout.PERIOD], q[layout.DELAY_FRACTION] = tau, min(p[layout.DELAY_FRACTION], tau)
    derive(q, s)
    events = 0.0
    for part in range(2):
        if q[layout.LENGTH + part] > 0.0 and events >= 0.0:
            u = s[layout.S_QUEUE + part]
            s[layout.S_HELD] = u
            if quick(q, s, part, u) == 0:
                events = closely(q, s, part, u, events)
    count_events(s, events)
    return int(s[layout.S_STATUS])
