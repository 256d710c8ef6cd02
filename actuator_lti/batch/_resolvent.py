"""(z I - A)^-1 b of a sampled loop as it is, at zero frequency without the modes it does not show, compiled.

Gains far below their largest value are differences of large numbers (an acceleration feed-forward). So the
states are not mixed as a Hessenberg form would: the zeros of A keep them apart.
"""

# mypy: disallow-untyped-defs=False
import math

from ._complex import over
from ._figures import HIDDEN
from ._response import substituted

KERNELS = True

EPS = 2.220446049250313e-16
NO_PIVOT = 1e-30  # far below the rounding of any entry that balancing leaves


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
    return substituted(n, c, work, state)


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
