"""Poles of a system with delays: each delay as a transport line, by Chebyshev collocation.

A delay tau is the line dq/dt = -(1/tau) dq/dx, 0 <= x <= 1, with the input at x = 0 and the output at x = 1.
Differentiation at Chebyshev points makes it a state space whose eigenvalues with |s| tau well below the
number of points are those of the exact delay to near machine precision (Breda, Maset, Vermiglio 2005).
Step responses with delays begin with them and sharpen them; nothing else rests on them.
"""

from __future__ import annotations

import numpy as np

from actuator_lti.margins.delays.form import DelayForm
from actuator_lti.margins.loop import Real


def chebyshev_differentiation(points: int) -> Real:
    """Differentiation matrix on x_j = (1 - cos(pi j/N))/2, j = 0 ... N, shape (N + 1, N + 1)."""
    j = np.arange(points + 1)
    x = 0.5 * (1.0 - np.cos(np.pi * j / points))
    weight = np.where((j == 0) | (j == points), 2.0, 1.0) * (-1.0) ** j
    D = np.outer(weight, 1.0 / weight) / (x[:, None] - x[None, :] + np.eye(points + 1))
    return D - np.diag(D.sum(axis=1))


def state_matrix(form: DelayForm, points: int) -> Real:
    """State matrix of a system with its inner delays collocated (a delay in series has no poles)."""
    n, q, N, delays = form.B1.size, form.delays_s.size, points, form.delays_s
    D = chebyshev_differentiation(N)
    M = np.zeros((n + q * N, n + q * N))
    M[:n, :n] = form.A
    ends = n + N * np.arange(1, q + 1) - 1
    M[:n, ends] = form.B2
    for k in range(q):
        rows = slice(n + k * N, n + (k + 1) * N)
        M[rows, rows] = -D[1:, 1:] / delays[k]
        M[rows, :n] -= np.outer(D[1:, 0], form.C2[k]) / delays[k]
        M[rows, ends] -= np.outer(D[1:, 0], form.D22[k]) / delays[k]
    return M
