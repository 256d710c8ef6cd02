"""Small matrix exponentials, and the transition of the slipping plant over a given time.

Matrices lie in a row of work space from a place ``at`` on, row by row: four of up to 7 by 7, `MATRIX` apart.
"""

from __future__ import annotations

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout

MATRIX = 49
TERMS = 19  # Taylor terms at norm 1/2: 0.5**19/19! = 1.6e-23


@kernel
def matmul(work, a, b, out, n):
    """Product of the n by n matrices at ``a`` and ``b``, written at ``out``."""
    for r in range(n):
        for c in range(n):
            total = 0.0
            for j in range(n):
                total += work[a + r * n + j] * work[b + j * n + c]
            work[out + r * n + c] = total


@kernel
def halvings_of(work, at, n):
    """How often a matrix is halved until its norm is at most 1/2."""
    norm = 0.0
    for r in range(n):
        total = 0.0
        for c in range(n):
            total += abs(work[at + r * n + c])
        norm = max(norm, total)
    halvings, scale = 0, 1.0
    while norm * scale > 0.5 and halvings < 1000:
        scale *= 0.5
        halvings += 1
    return halvings, scale


@kernel
def exponential(work, at, n):
    """exp of the n by n matrix at ``at``, which is scaled, at ``at + MATRIX``: Taylor series and squaring."""
    result, term, product = at + MATRIX, at + 2 * MATRIX, at + 3 * MATRIX
    halvings, scale = halvings_of(work, at, n)
    size = n * n
    for j in range(size):
        work[at + j] *= scale
        work[result + j] = 0.0
        work[term + j] = 0.0
    for r in range(n):
        work[result + r * n + r] = 1.0
        work[term + r * n + r] = 1.0
    for j in range(1, TERMS):
        matmul(work, term, at, product, n)
        for m in range(size):
            work[term + m] = work[product + m] / j
            work[result + m] += work[term + m]
    for _ in range(halvings):
        matmul(work, result, result, product, n)
        for m in range(size):
            work[result + m] = work[product + m]


@kernel
def plant(p, reverse, dt, work, at, n):
    """Write dt times the slipping plant at ``at``, n by n: states (i, w, th, u, T, ...), inputs held."""
    for j in range(n * n):
        work[at + j] = 0.0
    J = p[layout.INERTIA]
    Cv = p[layout.VISCOUS_REVERSE] if reverse > 0 else p[layout.VISCOUS]
    if p[layout.SOURCE] > 0.0:
        work[at + n + 3] = dt * p[layout.SOURCE_GAIN] / J
    else:
        L = p[layout.INDUCTANCE]
        work[at] = -dt * p[layout.RESISTANCE] / L
        work[at + 1] = -dt * p[layout.BACK_EMF] / L
        work[at + 3] = dt / L
        work[at + n] = dt * p[layout.TORQUE_CONSTANT] / J
    work[at + n + 1] = -dt * Cv / J
    work[at + n + 4] = dt / J
    work[at + 2 * n + 1] = dt


@kernel
def transition(p, reverse, dt, work, at, out):
    """Write the twelve coefficients of the slipping plant over dt at ``p[out]``."""
    plant(p, reverse, dt, work, at, layout.SLIP_ORDER)
    exponential(work, at, layout.SLIP_ORDER)
    e = at + MATRIX
    p[out + layout.A11], p[out + layout.A12] = work[e], work[e + 1]
    p[out + layout.A21], p[out + layout.A22] = work[e + 5], work[e + 6]
    p[out + layout.A31], p[out + layout.A32] = work[e + 10], work[e + 11]
    for r in range(3):
        p[out + layout.B1 + r] = work[e + 5 * r + 3]
        p[out + layout.C1 + r] = work[e + 5 * r + 4]
