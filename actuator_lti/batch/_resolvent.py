"""(z I - A)^-1 b of a sampled loop as it is, compiled.

Gains far below their largest value are differences of large numbers (an acceleration feed-forward). So the
states are not mixed as a Hessenberg form would: the zeros of A keep them apart.
"""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import math

from actuator_lti.compiled.kernel import kernel

from ._complex import over
from ._response import substituted


@kernel
def _largest_first(n, k, work, state):
    """Bring the largest element of column k, from row k on, to row k."""
    best, largest = k, -1.0
    for i in range(k, n):
        size = abs(work[2 * (i * n + k)]) + abs(work[2 * (i * n + k) + 1])
        if size > largest:
            best, largest = i, size
    if best == k:
        return
    for j in range(2 * n):
        work[2 * k * n + j], work[2 * best * n + j] = work[2 * best * n + j], work[2 * k * n + j]
    for j in range(2):
        state[2 * k + j], state[2 * best + j] = state[2 * best + j], state[2 * k + j]


@kernel
def _cleared(n, k, work, state):
    """Take row k out of the rows below it."""
    for i in range(k + 1, n):
        at, up = 2 * (i * n + k), 2 * (k * n + k)
        if work[at] == 0.0 and work[at + 1] == 0.0:
            continue
        factor_r, factor_i = over(work[at], work[at + 1], work[up], work[up + 1])
        for j in range(1, n - k):
            here_r, here_i = work[up + 2 * j], work[up + 2 * j + 1]
            work[at + 2 * j] -= factor_r * here_r - factor_i * here_i
            work[at + 2 * j + 1] -= factor_r * here_i + factor_i * here_r
        here_r, here_i = state[2 * k], state[2 * k + 1]
        state[2 * i] -= factor_r * here_r - factor_i * here_i
        state[2 * i + 1] -= factor_r * here_i + factor_i * here_r


@kernel
def states_at(n, a, b, c, transposed, x, work, state):
    """(z I - A)^-1 b at an angle per sample, as pairs in ``state``, and c times it; or of A transposed."""
    sine = math.sin(0.5 * x)
    for i in range(n):
        for j in range(n):
            work[2 * (i * n + j)] = -a[j * n + i] if transposed else -a[i * n + j]
            work[2 * (i * n + j) + 1] = 0.0
        work[2 * (i * n + i)] = (1.0 - a[i * n + i]) - 2.0 * sine * sine
        work[2 * (i * n + i) + 1] = math.sin(x)
        state[2 * i], state[2 * i + 1] = b[i], 0.0
    for k in range(n):
        _largest_first(n, k, work, state)
        _cleared(n, k, work, state)
    response_r, response_i = substituted(n, c, work, state)
    return response_r, response_i
