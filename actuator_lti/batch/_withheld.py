"""Whether rounding decides the figures of a loop, compiled: then it has none.

An unstable inner loop that runs many times within one update of the outer one leaves entries of 1e12 and more
in the outer loop's matrices, which nearly cancel in its response. Every crossover of such a design, and the
response at some angles between, must stand out from its own rounding errors. Nor has a loop any figures where
its largest pole lies on the unit circle but for rounding, which would decide about stability, or where the
number of its gain crossovers does not fit the gain at both ends, because one lies below the angles that were
scanned.
"""

# mypy: disallow-untyped-defs=False
import math

import numpy as np

from ._complex import size_at
from ._figures import DC_GAIN, FIRST_GAIN, FIRST_PHASE, GAIN_CROSSOVERS, LISTED, PHASE_CROSSOVERS, RADIUS
from ._linalg import balance
from ._resolvent import EPS, states_at, system_at_dc

KERNELS = True

AT_LIMIT = 1e-10  # of the largest pole from the unit circle, or T(0) from 1/2: rounding decides
GROWTH = 10.0  # of an open-loop pole in one sample: below it the entries stay small
MOST_ERROR = 1e-10  # relative, of the response at a crossover: the margins are then good to 1e-8
BETWEEN = np.array([0.03, 0.3, 1.0, 2.5])


def _is_resolved(n, a, b, c, x, work, state, sizes):
    """Whether L at an angle stands out from its rounding errors, see `actuator_lti.margins.trust`."""
    states_at(n, a, c, b, True, x, work, state)
    for i in range(n):
        sizes[i] = size_at(state, i)
    real, imaginary = states_at(n, a, b, c, False, x, work, state)
    bound = 0.0
    for i in range(n):
        size = size_at(state, i)
        spread = size
        for j in range(n):
            spread += abs(a[i * n + j]) * size_at(state, j)
        bound += sizes[i] * spread + size * abs(c[i]) + sizes[i] * abs(b[i])
    return math.hypot(real, imaginary) * MOST_ERROR >= EPS * bound


def _crossings_are_resolved(n, a, b, c, poles, row, work, state, sizes):
    """The same at every crossover and between; at rest without the modes that do not show, as its figures."""
    at_rest = False
    for k in range(BETWEEN.shape[0]):
        if not _is_resolved(n, a, b, c, BETWEEN[k], work, state, sizes):
            return False
    for k in range(min(int(row[GAIN_CROSSOVERS]), LISTED)):
        if not _is_resolved(n, a, b, c, row[FIRST_GAIN + 2 * k], work, state, sizes):
            return False
    for k in range(min(int(row[PHASE_CROSSOVERS]), LISTED)):
        x = row[FIRST_PHASE + 2 * k]
        at_rest = at_rest or (x == 0.0 and math.isfinite(row[DC_GAIN]))
        if x != 0.0 and not _is_resolved(n, a, b, c, x, work, state, sizes):
            return False
    if not at_rest:
        return True
    system_at_dc(n, a, b, c, 0.0, poles, 0, work, sizes, state)
    for i in range(n):
        for j in range(n):
            a[i * n + j] = (1.0 if i == j else 0.0) - work[i * n + j]
    return _is_resolved(n, a, b, c, 0.0, work, state, sizes)


def _crossover_missed(n, a, b, c, row, work, state):
    """Whether the number of gain crossovers does not fit the gain at both ends: one lies below the scan."""
    dc = row[DC_GAIN]  # |L(0)| > 1 from T(0) = L(0)/(1 + L(0)), also with a pole there
    if not math.isfinite(dc) or abs(dc - 0.5) < AT_LIMIT:  # |L(0)| = 1 but for rounding: both numbers fit
        return False
    single = row[GAIN_CROSSOVERS] - 2.0 * float(math.floor(0.5 * row[GAIN_CROSSOVERS]))
    if single == (1.0 if dc > 0.5 else 0.0):
        return False
    nyquist, _unused = states_at(n, a, b, c, False, math.pi, work, state)
    return not abs(nyquist) > 1.0


def rounding_decides(n, a, b, c, poles, row, work, state, sizes):
    """Whether rounding decides the figures in ``row`` of the open loop a, b, c, which are changed."""
    balance(n, a, b, c)
    if abs(row[RADIUS] - 1.0) < AT_LIMIT or _crossover_missed(n, a, b, c, row, work, state):
        return True
    fastest = 0.0
    for i in range(n):
        fastest = max(fastest, math.hypot(poles[i], poles[n + i]))
    return fastest > GROWTH and not _crossings_are_resolved(n, a, b, c, poles, row, work, state, sizes)
