"""Which figures double precision cannot follow: the rule of `actuator_lti.batch.withheld`; emitted only."""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import math

import numpy as np

from actuator_lti.batch._figures import (
    FIRST_GAIN,
    FIRST_PHASE,
    GAIN_CROSSOVERS,
    LISTED,
    PHASE_CROSSOVERS,
    RADIUS,
)
from actuator_lti.batch.withheld import AT_BORDER
from actuator_lti.compiled.kernel import kernel
from nonlinear.export.linear_limiters import states_at

GROWTH = 10.0  # of an open-loop pole in one sample: below it the entries stay small
MOST_ERROR = 1e-10  # relative, of the response at a crossover
BETWEEN = np.array([0.03, 0.3, 1.0, 2.5])
EPS = 2.220446049250313e-16


@kernel
def told(n, a, b, c, x, work, state, lent, sizes):
    """How many of its own rounding errors L is at an angle, as `actuator_lti.margins.trust.told_from_zero`.

    ``lent`` holds the transpose of ``a``, ``sizes`` lends n numbers.
    """
    states_at(n, lent, c, x, work, state)
    for i in range(n):
        sizes[i] = math.hypot(state[2 * i], state[2 * i + 1])
    states_at(n, a, b, x, work, state)
    real, imaginary, bound = 0.0, 0.0, 0.0
    for i in range(n):
        real += c[i] * state[2 * i]
        imaginary += c[i] * state[2 * i + 1]
        size = math.hypot(state[2 * i], state[2 * i + 1])
        spread = size
        for j in range(n):
            spread += abs(a[i * n + j]) * math.hypot(state[2 * j], state[2 * j + 1])
        bound += sizes[i] * spread + size * abs(c[i]) + sizes[i] * abs(b[i])
    return math.hypot(real, imaginary) / (EPS * bound) if bound > 0.0 else math.inf


@kernel
def rounding_decides(n, a, b, c, poles, row, work, state, lent, sizes):
    """Whether rounding decides the figures in ``row`` of the loop a, b, c, as it was before `one_loop`."""
    if abs(row[RADIUS] - 1.0) < AT_BORDER:
        return 1
    fastest = 0.0
    for i in range(n):
        fastest = max(fastest, math.hypot(poles[i], poles[n + i]))
    if fastest <= GROWTH:
        return 0
    for i in range(n):
        for j in range(n):
            lent[j * n + i] = a[i * n + j]
    for k in range(4):
        if not (told(n, a, b, c, BETWEEN[k], work, state, lent, sizes) * MOST_ERROR >= 1.0):
            return 1
    for k in range(min(int(row[GAIN_CROSSOVERS]), LISTED)):
        if not (told(n, a, b, c, row[FIRST_GAIN + 2 * k], work, state, lent, sizes) * MOST_ERROR >= 1.0):
            return 1
    for k in range(min(int(row[PHASE_CROSSOVERS]), LISTED)):
        if not (told(n, a, b, c, row[FIRST_PHASE + 2 * k], work, state, lent, sizes) * MOST_ERROR >= 1.0):
            return 1
    return 0
