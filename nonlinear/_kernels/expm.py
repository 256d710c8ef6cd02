"""Small matrix exponentials, and the transition of the slipping plant over a given time."""

from __future__ import annotations

import numpy as np

from nonlinear._kernels import layout
from nonlinear._kernels.compiled import kernel

# coefficients of one transition, x+ = A x + b u + c T with x = (i, w, th)
A11, A12, A21, A22, A31, A32, B1, B2, B3, C1, C2, C3 = range(12)
TRANSITION = 12
TERMS = 19  # Taylor terms at norm 1/2: 0.5**19/19! = 1.6e-23


@kernel
def matmul(a, b, out, n):  # type: ignore[no-untyped-def]
    """Product of two small square matrices."""
    for r in range(n):
        for c in range(n):
            total = 0.0
            for j in range(n):
                total += a[r, j] * b[j, c]
            out[r, c] = total


@kernel
def exponential(a):  # type: ignore[no-untyped-def]
    """exp(a) by scaling, Taylor series and squaring."""
    n = a.shape[0]
    norm = 0.0
    for r in range(n):
        total = 0.0
        for c in range(n):
            total += abs(a[r, c])
        norm = max(norm, total)
    halvings = 0
    while norm > 0.5 and halvings < 1000:
        norm *= 0.5
        halvings += 1
    scale = 0.5**halvings
    result, term, work = np.eye(n), np.eye(n), np.empty((n, n))
    scaled = a * scale
    for j in range(1, TERMS):
        matmul(term, scaled, work, n)
        for r in range(n):
            for c in range(n):
                term[r, c] = work[r, c] / j
                result[r, c] += term[r, c]
    for _ in range(halvings):
        matmul(result, result, work, n)
        result[:] = work
    return result


@kernel
def plant(p, reverse, size):  # type: ignore[no-untyped-def]
    """Matrix of the slipping plant for states (i, w, th, u, T, ...) with held inputs."""
    a = np.zeros((size, size))
    J = p[layout.INERTIA]
    Cv = p[layout.VISCOUS_REVERSE] if reverse else p[layout.VISCOUS]
    if p[layout.SOURCE] > 0.0:
        a[1, 3] = p[layout.SOURCE_GAIN] / J
    else:
        L = p[layout.INDUCTANCE]
        a[0, 0] = -p[layout.RESISTANCE] / L
        a[0, 1] = -p[layout.BACK_EMF] / L
        a[0, 3] = 1.0 / L
        a[1, 0] = p[layout.TORQUE_CONSTANT] / J
    a[1, 1] = -Cv / J
    a[1, 4] = 1.0 / J
    a[2, 1] = 1.0
    return a


@kernel
def transition(p, reverse, dt, out, at):  # type: ignore[no-untyped-def]
    """Write the twelve coefficients of the slipping plant over dt at ``out[at]``."""
    e = exponential(plant(p, reverse, 5) * dt)
    out[at + A11], out[at + A12] = e[0, 0], e[0, 1]
    out[at + A21], out[at + A22] = e[1, 0], e[1, 1]
    out[at + A31], out[at + A32] = e[2, 0], e[2, 1]
    for row in range(3):
        out[at + B1 + row] = e[row, 3]
        out[at + C1 + row] = e[row, 4]
