"""Any loop with exact delays, inside or in series."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgebal

from actuator_lti.errors import InputError
from actuator_lti.margins.loop import Complex, RationalLoop, Real


@dataclass(frozen=True)
class DelayForm:
    """Linear fractional form with exact delays, balanced.

    dx/dt = A x + B1 u + B2 z, y = C1 x + D11 u + D12 z, v = C2 x + D21 u + D22 z, z_k(t) = v_k(t - delays_k),
    and all of it behind one more delay ``series_s``.
    """

    A: Real
    B1: Real
    B2: Real
    C1: Real
    C2: Real
    D11: float
    D12: Real
    D21: Real
    D22: Real
    delays: Real
    series_s: float = 0.0


def delay_form(system: Any, series_s: float = 0.0) -> DelayForm:
    """From a system with the attributes of a `DelaySystem` (A, B1, ..., D22, delays_s)."""
    A = np.asarray(system.A, dtype=float)
    q, n = np.size(system.delays_s), A.shape[0]
    B1, C1 = np.reshape(system.B1, (n, -1)), np.reshape(system.C1, (-1, n))
    if np.size(system.D11) != 1:
        raise InputError(f"a loop has one input and one output; this has D11 of shape {np.shape(system.D11)}")
    top = np.hstack((A, np.reshape(system.B2, (n, q)), B1.reshape(n, 1)))
    middle = np.hstack(
        (np.reshape(system.C2, (q, n)), np.reshape(system.D22, (q, q)), np.reshape(system.D21, (q, 1)))
    )
    bottom = np.hstack((C1.reshape(1, n), np.reshape(system.D12, (1, q)), np.reshape(system.D11, (1, 1))))
    return _form(
        np.vstack((top, middle, bottom)), n, np.asarray(system.delays_s, dtype=float).ravel(), series_s
    )


def in_series(loop: RationalLoop, series_s: float) -> DelayForm:
    """A rational loop behind a delay."""
    n = loop.order
    whole = np.empty((n + 1, n + 1))
    whole[:n, :n], whole[:n, n], whole[n, :n], whole[n, n] = loop.A, loop.b, loop.c, loop.d
    return _form(whole, n, np.empty(0), series_s)


def _form(whole: Real, n: int, delays: Real, series_s: float) -> DelayForm:
    if not np.isfinite(whole).all() or not np.isfinite(delays).all():
        raise InputError("the loop holds a value that is not finite")
    m = n + delays.size
    M = whole
    if m:
        M, _, _, _, _ = dgebal(whole, scale=1, permute=0)
        M[m, m] = whole[m, m]
    return DelayForm(
        A=M[:n, :n], B1=M[:n, m], B2=M[:n, n:m], C1=M[m, :n], C2=M[n:m, :n], D11=float(M[m, m]),
        D12=M[m, n:m], D21=M[n:m, m], D22=M[n:m, n:m], delays=delays, series_s=series_s,
    )  # fmt: skip


def border_values(form: DelayForm, x: Real) -> Complex:
    """The loop on s = j x."""
    F, lag = _matrix(form, 1j * x)
    right = np.concatenate((form.B1, form.D21)).astype(complex)
    X = np.linalg.solve(F, right[:, None])[..., 0] if right.size else np.zeros((x.size, 0))
    return (form.D11 + (_output(form, lag) * X).sum(axis=1)) * np.exp(-1j * x * form.series_s)


def _matrix(form: DelayForm, points: Complex) -> tuple[Complex, Complex]:
    n, q = form.B1.size, form.delays.size
    F = np.zeros((points.size, n + q, n + q), dtype=complex)
    F[:, :n, :n] = -form.A
    index = np.arange(n)
    F[:, index, index] += points[:, None]
    lag = np.exp(-points[:, None] * form.delays)
    if q:
        F[:, :n, n:] = -form.B2 * lag[:, None, :]
        F[:, n:, :n] = -form.C2
        F[:, n:, n:] = np.eye(q) - form.D22 * lag[:, None, :]
    return F, lag


def characteristic(form: DelayForm, s: complex) -> tuple[Complex, Complex, Complex, Complex]:
    """At one point: F(s), dF/ds, and the row and column of L = D11 + row F^-1 column."""
    F, lag = _matrix(form, np.array([s]))
    n, q = form.B1.size, form.delays.size
    slope = np.zeros_like(F[0])
    slope[:n, :n] = np.eye(n)
    late = form.delays * lag[0]
    slope[:n, n:], slope[n:, n:] = form.B2 * late, form.D22 * late
    column = np.concatenate((form.B1, form.D21)).astype(complex)
    return F[0], slope, _output(form, lag)[0], column if q else column[:n]


def _output(form: DelayForm, lag: Complex) -> Complex:
    n = form.B1.size
    row = np.empty((lag.shape[0], n + form.delays.size), dtype=complex)
    row[:, :n] = form.C1
    row[:, n:] = form.D12 * lag
    return row
