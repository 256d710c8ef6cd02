"""A sampled loop at zero frequency, without the modes there that it does not show, compiled."""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import math

from actuator_lti.compiled.kernel import kernel

from ._figures import HIDDEN

EPS = 2.220446049250313e-16
NO_PIVOT = 1e-30  # far below the rounding of any entry that balancing leaves


@kernel
def _pivoted(n, k, system, first, right):
    """Exchange rows so that the largest pivot stands in row k; one of zero counts as rounding."""
    best = k
    for i in range(k + 1, n):
        if abs(system[first + i * n + k]) > abs(system[first + best * n + k]):
            best = i
    right[k], right[best] = right[best], right[k]
    for j in range(k, n):
        here, there = first + k * n + j, first + best * n + j
        system[here], system[there] = system[there], system[here]
    if system[first + k * n + k] == 0.0:
        system[first + k * n + k] = NO_PIVOT


@kernel
def _solved(n, system, transposed, right):
    """Solve the system at the start of a row, or its transpose, behind it; ``right`` becomes the solution."""
    first = n * n
    for i in range(n):
        for j in range(n):
            system[first + i * n + j] = system[j * n + i] if transposed else system[i * n + j]
    for k in range(n):
        _pivoted(n, k, system, first, right)
        for i in range(k + 1, n):
            factor = system[first + i * n + k] / system[first + k * n + k]
            right[i] -= factor * right[k]
            for j in range(k, n):
                system[first + i * n + j] -= factor * system[first + k * n + j]
    i = n - 1
    while i >= 0:
        for j in range(i + 1, n):
            right[i] -= system[first + i * n + j] * right[j]
        right[i] /= system[first + i * n + i]
        i -= 1


@kernel
def _null_vector(n, system, transposed, vector):
    """What the system, all but singular, takes to nothing; its largest element is one."""
    for i in range(n):
        vector[i] = 1.0
    for _round in range(2):
        _solved(n, system, transposed, vector)
        largest = 0.0
        for i in range(n):
            largest = max(largest, abs(vector[i]))
        for i in range(n):
            vector[i] /= largest


@kernel
def system_at_dc(n, a, b, c, closed, poles, first, system, left, right):
    """Write I - A + closed b c without the modes at DC that do not show.

    Each of these, found among the poles from ``first`` on, is moved away by v w' of its right and left
    eigenvectors. A is as it is, not yet of Hessenberg form, which keeps 16 digits of A but not of slow poles,
    the differences of A and the identity.
    """
    for i in range(n):
        for j in range(n):
            system[i * n + j] = closed * b[i] * c[j] - a[i * n + j]
        system[i * n + i] = 1.0 - a[i * n + i] + closed * b[i] * c[i]
    for k in range(n):
        if math.hypot(poles[first + k] - 1.0, poles[first + n + k]) <= HIDDEN:
            _null_vector(n, system, False, right)
            _null_vector(n, system, True, left)
            for i in range(n):
                for j in range(n):
                    system[i * n + j] += right[i] * left[j]


@kernel
def level_at_dc(n, a, b, c, closed, poles, first, system, left, right):
    """c (I - A + closed b c)^-1 b without the modes at DC that do not show: T, or L where ``closed`` is 0."""
    system_at_dc(n, a, b, c, closed, poles, first, system, left, right)
    for i in range(n):
        right[i] = b[i]
    _solved(n, system, False, right)
    total = 0.0
    for i in range(n):
        total += c[i] * right[i]
    return total


@kernel
def rounding_at_dc(n, a, b, c, system, left, right):
    """How far 8 ulp of the entries move what `level_at_dc` has left in its rows, at most."""
    for i in range(n):
        left[i] = c[i]
    _solved(n, system, True, left)
    total = 0.0
    for i in range(n):
        spread = abs(right[i]) + abs(b[i])
        for j in range(n):
            spread += abs(a[i * n + j] * right[j])
        total += abs(left[i]) * spread + abs(c[i] * right[i])
    return 8.0 * EPS * total
