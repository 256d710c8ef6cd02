"""Zero frequency itself: the rules of `actuator_lti.batch.rest` and ``withheld``; emitted only.

The scan of angles only comes near to it, and its Hessenberg form loses the differences of A and the identity.
"""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import math

import numpy as np

from actuator_lti.batch._figures import (
    DC_GAIN,
    FINAL,
    FIRST_PHASE,
    GAIN_CROSSOVERS,
    LISTED,
    MODULUS,
    MODULUS_X,
)
from actuator_lti.compiled.kernel import kernel
from actuator_lti.systems import rest_mode as rest_mode_rule
from actuator_lti.systems.rest_mode import ROUNDED
from nonlinear.export.linear_limiters import states_at

LEAST = np.array(rest_mode_rule.LEAST)


@kernel
def real_response(n, a, b, c, x, work, state):
    """L at an angle where it is real, 0 or pi; infinite or NaN where it has a pole there."""
    states_at(n, a, b, x, work, state)
    total = 0.0
    for i in range(n):
        total += c[i] * state[2 * i]
    return total


@kernel
def entry(n, a, i, k, turned):
    """An element of A, or of its transpose."""
    return a[k * n + i] if turned > 0 else a[i * n + k]


@kernel
def row_size(n, a, c, i, j, turned, v):
    """Largest term of A v = v (row n: of c v = 0); with v_j = 0, before v is known, the largest factor."""
    size = 0.0
    for k in range(n):
        value = abs(c[k]) if i == n else abs(entry(n, a, i, k, turned))
        if v[j] == 0.0:
            value = abs(c[k]) if i == n else abs(entry(n, a, i, k, turned) - (1.0 if i == k else 0.0))
            size = max(size, value)
        else:
            size += value * abs(v[k])
    return size if size > 0.0 else 1.0


@kernel
def posed(n, a, c, j, turned, v, system):
    """Write A v = v, c v = 0 for v_j = 1: n + 1 scaled rows of n - 1 unknowns and the right side."""
    for i in range(n + 1):
        size = row_size(n, a, c, i, j, turned, v)
        for k in range(n):
            value = c[k] if i == n else entry(n, a, i, k, turned) - (1.0 if i == k else 0.0)
            to = n - 1 if k == j else (k if k < j else k - 1)
            system[i * n + to] = (-value if k == j else value) / size


@kernel
def scaled_columns(n, system, sizes):
    """Scale the unknowns, so that the largest term of each is 1."""
    for k in range(n - 1):
        sizes[k] = 0.0
        for i in range(n + 1):
            sizes[k] = max(sizes[k], abs(system[i * n + k]))
        if sizes[k] <= 0.0:
            return 0
        for i in range(n + 1):
            system[i * n + k] /= sizes[k]
    return 1


@kernel
def eliminated(n, system):
    """Bring n + 1 rows of n - 1 unknowns to triangular form, rows exchanged; 0 where they are dependent."""
    for k in range(n - 1):
        best = k
        for i in range(k, n + 1):
            if abs(system[i * n + k]) > abs(system[best * n + k]):
                best = i
        if system[best * n + k] == 0.0:
            return 0
        for m in range(k, n):
            kept = system[k * n + m]
            system[k * n + m] = system[best * n + m]
            system[best * n + m] = kept
        for i in range(k + 1, n + 1):
            factor = system[i * n + k] / system[k * n + k]
            for m in range(k, n):
                system[i * n + m] -= factor * system[k * n + m]
    return 1


@kernel
def holds_at_rest(n, a, c, j, turned, v):
    """Whether A v = v and c v = 0 hold within the rounding of the entries, and v is more than v_j."""
    seen, terms, others = 0.0, 0.0, 0
    for i in range(n):
        left, allowed = -v[i], abs(v[i])
        for k in range(n):
            left += entry(n, a, i, k, turned) * v[k]
            allowed += abs(entry(n, a, i, k, turned) * v[k])
        if abs(left) > ROUNDED * allowed:
            return 0
        seen += c[i] * v[i]
        terms += abs(c[i] * v[i])
        if i != j and v[i] != 0.0:
            others = 1
    return others if abs(seen) <= ROUNDED * terms else 0


@kernel
def solved_mode(n, a, c, j, turned, system, sizes, v):
    """Solve A v = v, c v = 0 for v_j = 1, each row over the size of its terms at the v given; 0 where not."""
    posed(n, a, c, j, turned, v, system)
    scaled = scaled_columns(n, system, sizes)
    if scaled == 0:
        return 0
    solved = eliminated(n, system)
    if solved == 0:
        return 0
    k = n - 2
    while k >= 0:
        total = system[k * n + n - 1]
        for m in range(k + 1, n - 1):
            total -= system[k * n + m] * sizes[n + m]
        sizes[n + k] = total / system[k * n + k]
        k -= 1
    for i in range(n):
        at = i if i < j else max(i - 1, 0)
        v[i] = 1.0 if i == j else sizes[n + at] / sizes[at]
    return 1


@kernel
def rest_mode(n, a, c, j, turned, system, sizes, v):
    """Find v with v_j = 1, A v = v and c v = 0 within rounding; 0 where there is none."""
    for i in range(n):
        v[i] = 0.0
    for _again in range(3):
        solved = solved_mode(n, a, c, j, turned, system, sizes, v)
        if solved == 0:
            return 0
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(v[i]))
    for tried in range(LEAST.shape[0]):
        for i in range(n):
            sizes[i] = v[i] if abs(v[i]) > LEAST[tried] * largest else 0.0
        found = holds_at_rest(n, a, c, j, turned, sizes)
        if found > 0:
            for i in range(n):
                v[i] = sizes[i]
            return 1
    return 0


@kernel
def entries_of(n, a, j, turned):
    """How many elements of a row of A, or of its transpose, are not zero."""
    count = 0
    for k in range(n):
        if entry(n, a, j, k, turned) != 0.0:
            count += 1
    return count


@kernel
def left_out(n, a, b, c, j, turned, v, a_less, b_less, c_less):
    """Copy the loop without the mode v at rest: state j stays as one that nothing moves."""
    for i in range(n):
        b_less[i] = b[i] if turned > 0 else b[i] - v[i] * b[j]
        c_less[i] = c[i] - c[j] * v[i] if turned > 0 else c[i]
        for k in range(n):
            less = a[i * n + j] * v[k] if turned > 0 else v[i] * a[j * n + k]
            a_less[i * n + k] = 0.0 if i == j or k == j else a[i * n + k] - less
    b_less[j], c_less[j] = 0.0, 0.0


@kernel
def level_at_rest(n, a, b, c, work, state, sizes, v, a_less, b_less, c_less):
    """L(0), without a mode at rest that the loop does not show (`actuator_lti.systems.rest_mode`)."""
    for turned in range(2):
        for fullness in range(1, n + 1):  # integrators that little else drives first
            for j in range(n):
                if n < 2 or a[j * n + j] != 1.0 or entries_of(n, a, j, turned) != fullness:
                    continue
                found = rest_mode(n, a, b if turned > 0 else c, j, turned, work, sizes, v)
                if found > 0:
                    left_out(n, a, b, c, j, turned, v, a_less, b_less, c_less)
                    return real_response(n, a_less, b_less, c_less, 0.0, work, state)
    return real_response(n, a, b, c, 0.0, work, state)


@kernel
def corrected_at_rest(n, a, b, c, row, work, state, sizes, v, a_less, b_less, c_less):
    """Correct the gain margin that ``row`` lists at zero frequency, and the distance |1 + L(0)|."""
    closed = row[DC_GAIN]
    if math.isnan(closed) and row[FINAL] == 0.0:  # a gain that is nothing beside the peak: L(0) is zero
        closed = 0.0
    distance = row[MODULUS]
    if closed != 1.0 and not math.isnan(closed):
        distance = 1.0 / abs(1.0 - closed)
    for k in range(LISTED):
        if row[FIRST_PHASE + 2 * k] == 0.0:
            level = level_at_rest(n, a, b, c, work, state, sizes, v, a_less, b_less, c_less)
            if math.isfinite(level) and level < 0.0:
                row[FIRST_PHASE + 2 * k + 1] = -1.0 / level
                distance = abs(1.0 + level)
    if distance < row[MODULUS]:
        row[MODULUS], row[MODULUS_X] = distance, 0.0


@kernel
def crossover_missed(n, a, b, c, row, work, state):
    """Whether the number of gain crossovers does not fit the gain at both ends: one lies below the scan."""
    if not math.isfinite(row[DC_GAIN]):
        return 0
    count = int(row[GAIN_CROSSOVERS])
    odd = count - 2 * int(count / 2)
    above = 1 if row[DC_GAIN] > 0.5 else 0  # |L(0)| > 1
    if odd == above:
        return 0
    return 1 if not (abs(real_response(n, a, b, c, math.pi, work, state)) > 1.0) else 0
