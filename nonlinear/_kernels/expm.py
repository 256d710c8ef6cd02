"""Small matrix exponentials, and the transition of the slipping plant over a given time."""

from __future__ import annotations

from nonlinear._kernels import layout
from nonlinear._kernels.compiled import scalar

# coefficients of one transition, x+ = A x + b u + c T with x = (i, w, th)
A11, A12, A21, A22, A31, A32, B1, B2, B3, C1, C2, C3 = range(12)
TRANSITION = 12
TERMS = 19  # Taylor terms at norm 1/2: 0.5**19/19! = 1.6e-23


@scalar
def matmul(a, b, out, n):  # type: ignore[no-untyped-def]
    """Product of two small square matrices."""
    for r in range(n):
        for c in range(n):
            total = 0.0
            for j in range(n):
                total += a[r, j] * b[j, c]
            out[r, c] = total


@scalar
def exponential(a, n, result, term, work):  # type: ignore[no-untyped-def]
    """exp of the leading n by n part of ``a`` (which is scaled): Taylor series and squaring."""
    norm = 0.0
    for r in range(n):
        total = 0.0
        for c in range(n):
            total += abs(a[r, c])
        norm = max(norm, total)
    halvings, scale = 0, 1.0
    while norm * scale > 0.5 and halvings < 1000:
        scale *= 0.5
        halvings += 1
    for r in range(n):
        for c in range(n):
            a[r, c] *= scale
            result[r, c] = term[r, c] = 1.0 if r == c else 0.0
    for j in range(1, TERMS):
        matmul(term, a, work, n)
        for r in range(n):
            for c in range(n):
                term[r, c] = work[r, c] / j
                result[r, c] += term[r, c]
    for _ in range(halvings):
        matmul(result, result, work, n)
        for r in range(n):
            for c in range(n):
                result[r, c] = work[r, c]


@scalar
def plant(p, reverse, dt, a):  # type: ignore[no-untyped-def]
    """Fill ``a`` with dt times the slipping plant, states (i, w, th, u, T, ...) with held inputs."""
    for r in range(a.shape[0]):
        for c in range(a.shape[0]):
            a[r, c] = 0.0
    J = p[layout.INERTIA]
    Cv = p[layout.VISCOUS_REVERSE] if reverse else p[layout.VISCOUS]
    if p[layout.SOURCE] > 0.0:
        a[1, 3] = dt * p[layout.SOURCE_GAIN] / J
    else:
        L = p[layout.INDUCTANCE]
        a[0, 0] = -dt * p[layout.RESISTANCE] / L
        a[0, 1] = -dt * p[layout.BACK_EMF] / L
        a[0, 3] = dt / L
        a[1, 0] = dt * p[layout.TORQUE_CONSTANT] / J
    a[1, 1] = -dt * Cv / J
    a[1, 4] = dt / J
    a[2, 1] = dt


@scalar
def transition(p, reverse, dt, space, out, at):  # type: ignore[no-untyped-def]
    """Write the twelve coefficients of the slipping plant over dt at ``out[at]``.

    ``space`` has shape (4, m, m), m >= 5: room for the calculation.
    """
    plant(p, reverse, dt, space[0])
    e = space[1]
    exponential(space[0], 5, e, space[2], space[3])
    out[at + A11], out[at + A12] = e[0, 0], e[0, 1]
    out[at + A21], out[at + A22] = e[1, 0], e[1, 1]
    out[at + A31], out[at + A32] = e[2, 0], e[2, 1]
    for row in range(3):
        out[at + B1 + row] = e[row, 3]
        out[at + C1 + row] = e[row, 4]
