"""A system with delays that all stand in series: a rational loop behind their sum."""

from __future__ import annotations

from typing import Any

import numpy as np

from actuator_lti.margins.given import Given
from actuator_lti.margins.loop import Mask


def in_series(system: Any) -> tuple[Given, float] | None:
    """The loop without its delays, and their sum, s; ``None`` where one stands in a loop or beside a path.

    By what feeds what: no delay reaches itself, and without any of them the output does not see the input.
    """
    A, B2, C2 = (np.asarray(x, dtype=float) for x in (system.A, system.B2, system.C2))
    n, q = A.shape[0], np.size(system.delays_s)
    b, c = np.reshape(system.B1, n).astype(float), np.reshape(system.C1, n).astype(float)
    D21, D12 = np.reshape(system.D21, q).astype(float), np.reshape(system.D12, q).astype(float)
    D22, d = np.reshape(system.D22, (q, q)).astype(float), float(np.reshape(system.D11, ())[()])
    feeds = np.block(
        [
            [A != 0.0, B2.reshape(n, q) != 0.0, b[:, None] != 0.0, np.zeros((n, 1), bool)],
            [C2.reshape(q, n) != 0.0, D22 != 0.0, D21[:, None] != 0.0, np.zeros((q, 1), bool)],
            [np.zeros((1, n + q + 2), bool)],
            [c[None] != 0.0, D12[None] != 0.0, np.array([[d != 0.0, False]])],
        ]
    )
    delays = np.arange(n, n + q)
    if _reached(feeds)[delays, delays].any():
        return None
    for k in delays:
        without = feeds.copy()
        without[k] = False
        if _reached(without)[-1, -2]:
            return None
    inner = np.linalg.inv(np.eye(q) - D22)
    into, out = B2.reshape(n, q) @ inner, D12 @ inner
    given = Given(
        None,
        A=A + into @ C2.reshape(q, n),
        b=b + into @ D21,
        c=c + out @ C2.reshape(q, n),
        d=float(d + out @ D21),
    )
    return given, float(np.sum(system.delays_s))


def _reached(feeds: Mask) -> Mask:
    """What each place is fed by, over any number of steps (row: fed, column: feeding)."""
    reached = feeds
    for _ in range(int(np.ceil(np.log2(feeds.shape[0]))) + 1):
        reached = reached | (reached.astype(int) @ reached.astype(int) > 0)
    return reached
