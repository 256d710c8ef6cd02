"""Poles of a system with delays: each delay as a transport line, by Chebyshev collocation.

A delay tau is the line dq/dt = -(1/tau) dq/dx, 0 <= x <= 1, with the input at x = 0 and the output at x = 1.
Differentiation at Chebyshev points makes it a state space whose eigenvalues with |s| tau well below the
number of points are those of the exact delay to near machine precision (Breda, Maset, Vermiglio 2005).
These poles are the second way to stability beside the Nyquist count; nothing else rests on them.
"""

from __future__ import annotations

import numpy as np

from actuator_lti.margins.delays.form import DelayForm
from actuator_lti.margins.loop import Real

_FEWEST, _MOST = 16, 90


def chebyshev_differentiation(points: int) -> Real:
    """Differentiation matrix on x_j = (1 - cos(pi j/N))/2, j = 0 ... N, shape (N + 1, N + 1)."""
    j = np.arange(points + 1)
    x = 0.5 * (1.0 - np.cos(np.pi * j / points))
    weight = np.where((j == 0) | (j == points), 2.0, 1.0) * (-1.0) ** j
    D = np.outer(weight, 1.0 / weight) / (x[:, None] - x[None, :] + np.eye(points + 1))
    return D - np.diag(D.sum(axis=1))


def points_for(form: DelayForm, fastest: float) -> int | None:
    """Collocation points for poles up to the frequency ``fastest`` (rad/s); ``None`` where too many."""
    longest = max([form.series_s, *form.delays_s.tolist()], default=0.0)
    points = 12 + 1.3 * fastest * longest
    return None if points > _MOST else int(max(points, _FEWEST))


def open_loop_matrix(form: DelayForm, points: int) -> Real:
    """State matrix of the loop, not closed, its inner delays collocated (a delay in series has no poles)."""
    return _collocated(form.A, form.B2, form.C2, form.D22, form.delays_s, points)


def closed_loop_matrix(form: DelayForm, points: int) -> Real:
    """State matrix of the loop closed by negative unit feedback, all delays collocated."""
    if form.series_s > 0.0:
        B2 = np.column_stack((form.B2, -form.B1))
        C2 = np.vstack((form.C2, form.C1))
        D22 = np.block([[form.D22, -form.D21[:, None]], [form.D12[None, :], np.array([[-form.D11]])]])
        return _collocated(form.A, B2, C2, D22, np.append(form.delays_s, form.series_s), points)
    gain = 1.0 / (1.0 + form.D11)
    return _collocated(
        form.A - gain * np.outer(form.B1, form.C1),
        form.B2 - gain * np.outer(form.B1, form.D12),
        form.C2 - gain * np.outer(form.D21, form.C1),
        form.D22 - gain * np.outer(form.D21, form.D12),
        form.delays_s,
        points,
    )


def _collocated(A: Real, B2: Real, C2: Real, D22: Real, delays: Real, points: int) -> Real:
    n, q, N = A.shape[0], delays.size, points
    D = chebyshev_differentiation(N)
    M = np.zeros((n + q * N, n + q * N))
    M[:n, :n] = A
    ends = n + N * np.arange(1, q + 1) - 1
    M[:n, ends] = B2
    for k in range(q):
        rows = slice(n + k * N, n + (k + 1) * N)
        M[rows, rows] = -D[1:, 1:] / delays[k]
        M[rows, :n] -= np.outer(D[1:, 0], C2[k]) / delays[k]
        M[rows, ends] -= np.outer(D[1:, 0], D22[k]) / delays[k]
    return M
