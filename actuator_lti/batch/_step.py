"""Step response of a sampled closed loop and its figures, compiled."""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

from ._figures import FINAL, OVERSHOOT, RADIUS, RISE, SETTLING

LONGEST = 200_000  # ticks


@njit(cache=True, nogil=True, error_model="numpy")
def step_figures(n, a, b, c, row):
    """Rise 10-90 % and settling 2 % in ticks, overshoot in percent, of the closed loop a - b c.

    Follows the samples; crossings of 10 % and 90 % are interpolated between them.
    """
    radius = row[RADIUS]
    final = row[FINAL]
    if not (radius < 1.0) or not (abs(final) > 0.0):
        return
    ticks = int(min(LONGEST, 50.0 + np.ceil(np.log(1e-6) / np.log(radius))))
    state = np.zeros(n)
    after = np.zeros(n)
    ten = np.nan
    ninety = np.nan
    highest = 0.0
    outside = 0
    before = 0.0
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
        if np.isnan(ten) and y >= 0.1:
            ten = k - (y - 0.1) / (y - before)
        if np.isnan(ninety) and y >= 0.9:
            ninety = k - (y - 0.9) / (y - before)
        highest = max(highest, y)
        if abs(y - 1.0) > 0.02:
            outside = k
        before = y
    row[RISE] = ninety - ten
    row[OVERSHOOT] = 100.0 * max(0.0, highest - 1.0)
    row[SETTLING] = outside + 1.0
