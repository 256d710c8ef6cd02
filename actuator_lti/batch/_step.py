"""Step response of a sampled closed loop and its figures, compiled."""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import numpy as np

from ._compiled import kernel
from ._figures import FINAL, OVERSHOOT, RADIUS, RISE, SETTLING

LONGEST = 4_000_000  # ticks


@kernel
def step_figures(n, a, b, c, row):
    """Rise 10-90 % and settling 2 % in ticks, overshoot in percent, of the closed loop a - b c.

    All are times of samples; the response is followed for 14 time constants of the slowest pole.
    """
    radius = row[RADIUS]
    final = row[FINAL]
    if not (radius < 1.0) or not (abs(final) > 0.0):
        return
    ticks = int(min(LONGEST, max(-14.0 / np.log(radius), n + 2.0)))
    state = np.zeros(n)
    after = np.zeros(n)
    ten = -1
    ninety = -1
    highest = 0.0
    outside = 0
    for k in range(1, ticks + 1):
        total = 0.0
        for j in range(n):
            total += c[j] * state[j]
        error = 1.0 - total
        for i in range(n):
            value = b[i] * error
            for j in range(n):
                value += a[i, j] * state[j]
            after[i] = value
        y = 0.0
        for j in range(n):
            state[j] = after[j]
            y += c[j] * after[j]
        y /= final
        if ten < 0 and y >= 0.1:
            ten = k
        if ninety < 0 and y >= 0.9:
            ninety = k
        highest = max(highest, y)
        if abs(y - 1.0) > 0.02:
            outside = k
    row[RISE] = ninety - ten if ninety >= 0 else np.nan
    row[OVERSHOOT] = 100.0 * (highest - 1.0) if highest > 1.0 + 1e-9 else 0.0
    row[SETTLING] = outside + 1.0
