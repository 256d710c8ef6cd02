"""Any loop with exact delays, inside or in series."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgebal

from actuator_lti.errors import InputError
from actuator_lti.margins.loop import Complex, RationalLoop, Real
from actuator_lti.systems.plain_delays import descriptor


@dataclass(frozen=True)
class DelayForm:
    """Linear fractional form with exact delays, balanced.

    dx/dt = A x + B1 u + B2 z, y = C1 x + D11 u + D12 z, v = C2 x + D21 u + D22 z, z_k(t) =
    v_k(t - delays_s_k), and all of it behind one more delay ``series_s``.
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
    delays_s: Real
    series_s: float = 0.0


def delay_form(system: Any, series_s: float = 0.0) -> DelayForm:
    """From a system with the attributes of a `DelaySystem` (A, B1, ..., D22, delays_s)."""
    A = np.asarray(system.A, dtype=float)
    q, n = np.size(system.delays_s), A.shape[0]
    if np.size(system.D11) != 1:
        raise InputError(f"a loop has one input and one output; this has D11 of shape {np.shape(system.D11)}")
    B1, C1 = np.reshape(system.B1, (n, 1)), np.reshape(system.C1, (1, n))
    top = np.hstack((A.reshape(n, n), np.reshape(system.B2, (n, q)), B1))
    middle = np.hstack(
        (np.reshape(system.C2, (q, n)), np.reshape(system.D22, (q, q)), np.reshape(system.D21, (q, 1)))
    )
    bottom = np.hstack((C1, np.reshape(system.D12, (1, q)), np.reshape(system.D11, (1, 1))))
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
        D12=M[m, n:m], D21=M[n:m, m], D22=M[n:m, n:m], delays_s=delays, series_s=series_s,
    )  # fmt: skip


def characteristic(form: DelayForm, s: complex) -> tuple[Complex, Complex, Complex, Complex]:
    """At one point: F(s), dF/ds, and the row and column of L = D11 + row F^-1 column."""
    F = descriptor(form, np.array([s]))[0]
    n, lag = form.B1.size, np.exp(-s * form.delays_s)
    slope = np.zeros_like(F)
    slope[:n, :n] = np.eye(n)
    late = form.delays_s * lag
    slope[:n, n:], slope[n:, n:] = form.B2 * late, form.D22 * late
    row = np.concatenate((form.C1, form.D12 * lag))
    return F, slope, row, np.concatenate((form.B1, form.D21)).astype(complex)
