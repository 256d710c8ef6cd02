"""Any loop with exact delays, inside or in series."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.margins.given import Given
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.types import Mask, Real


@dataclass(frozen=True)
class DelayForm:
    """Linear fractional form with exact delays, one matrix: (dx/dt, v, y) = whole (x, z, u)."""

    whole: Real  # (n + q + 1, n + q + 1): [A, B2, B1; C2, D22, D21; C1, D12, D11]
    delays_s: Real  # (q,): z_k(t) = v_k(t - delays_s_k)
    series_s: float = 0.0  # one more delay, behind all of it

    @property
    def states(self) -> int:
        return self.whole.shape[0] - 1 - self.delays_s.size


def delay_form(system: Any, series_s: float = 0.0) -> DelayForm:
    """From a system with the attributes of a `DelaySystem` (A, B1, ..., D22, delays_s)."""
    if np.size(system.D11) != 1:
        raise InputError(f"a loop has one input and one output; this has D11 of shape {np.shape(system.D11)}")
    rows = [
        [system.A, system.B2, system.B1],
        [system.C2, system.D22, system.D21],
        [system.C1, system.D12, system.D11],
    ]
    whole, delays_s = np.block(rows).astype(float), np.asarray(system.delays_s, dtype=float).ravel()
    if not np.isfinite(whole).all() or not np.isfinite(delays_s).all():
        raise InputError("the loop holds a value that is not finite")
    return DelayForm(whole, delays_s, series_s)


def in_series(loop: RationalLoop, series_s: float) -> DelayForm:
    """A rational loop behind a delay."""
    whole = np.block([[loop.A, loop.b[:, None]], [loop.c, np.array([loop.d])]])
    return DelayForm(whole, np.empty(0), series_s)


def without_series_delays(form: DelayForm) -> tuple[Given, float] | None:
    """A loop without its delays, and their sum, s; ``None`` where one stands in a loop or beside a path.

    By what feeds what: no delay reaches itself, and without any of them the output does not see the input.
    """
    n, whole = form.states, form.whole
    m = whole.shape[0] - 1
    feeds = np.zeros((m + 2, m + 2), bool)  # row: fed, column: feeding; states, delays, input, output
    feeds[:m, : m + 1], feeds[-1, : m + 1] = whole[:m] != 0.0, whole[m] != 0.0
    delays = np.arange(n, m)
    if _reached(feeds)[delays, delays].any():
        return None
    for k in delays:
        without = feeds.copy()
        without[k] = False
        if _reached(without)[-1, -2]:
            return None
    rest = [*range(n), m]
    past = whole[np.ix_(rest, delays)] @ np.linalg.inv(np.eye(delays.size) - whole[n:m, n:m])
    free = whole[np.ix_(rest, rest)] + past @ whole[np.ix_(delays, rest)]
    given = Given(None, A=free[:n, :n], b=free[:n, n], c=free[n, :n], d=float(free[n, n]))
    return given, float(np.sum(form.delays_s)) + form.series_s


def _reached(feeds: Mask) -> Mask:
    """What each place is fed by, over any number of steps."""
    reached = feeds
    for _ in range(int(np.ceil(np.log2(feeds.shape[0]))) + 1):
        reached = reached | (reached.astype(int) @ reached.astype(int) > 0)
    return reached
