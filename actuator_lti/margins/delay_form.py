"""Any loop with exact delays, inside or in series, evaluated with a bound between two frequencies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgebal

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.factors import poles, zeros
from actuator_lti.margins.loop import Complex, RationalLoop, Real

_CHUNK = 512


@dataclass(frozen=True)
class DelayForm:
    """Linear fractional form with exact delays, balanced.

    dx/dt = A x + B1 u + B2 z, y = C1 x + D11 u + D12 z, v = C2 x + D21 u + D22 z, z_k(t) = v_k(t - delays_k),
    and all of it behind one more delay ``series_s``. A sampled loop (``period_s``) has no inner delays;
    its argument x is the angle of z, as in `RationalLoop`. ``zeros`` and ``poles`` of a loop without inner
    delays give a closer bound.
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
    period_s: float | None = None
    zeros: Complex | None = None
    poles: Complex | None = None

    @property
    def sampled(self) -> bool:
        """Whether x is the angle of z."""
        return self.period_s is not None

    @property
    def series(self) -> float:
        """Delay in series, in the unit 1/x: s, or samples."""
        return self.series_s if self.period_s is None else self.series_s / self.period_s

    def without_series(self) -> DelayForm:
        """The same loop without the delay in series."""
        return replace(self, series_s=0.0)


@dataclass(frozen=True)
class Intervals:
    """Values at the middle of intervals, and how far the curve can be from them inside.

    Attributes
    ----------
    x, half : arrays
        Middle and half width.
    L, slope : arrays, complex
        The loop (series delay included) and its derivative by x.
    spread : array
        Bound of |L0 - L0(x)| over the interval, L0 the loop without the series delay; inf: no bound.
    """

    x: Real
    half: Real
    L: Complex
    slope: Complex
    spread: Real


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
        np.vstack((top, middle, bottom)), n, np.asarray(system.delays_s, dtype=float).ravel(), series_s, None
    )


def from_rational(loop: RationalLoop, series_s: float) -> DelayForm:
    """A rational loop behind a delay, with its zeros and poles."""
    return replace(in_series(loop, series_s), zeros=zeros(loop), poles=poles(loop))


def in_series(loop: RationalLoop, series_s: float) -> DelayForm:
    """A rational loop behind a delay."""
    n = loop.order
    whole = np.empty((n + 1, n + 1))
    whole[:n, :n], whole[:n, n], whole[n, :n], whole[n, n] = loop.A, loop.b, loop.c, loop.d
    return _form(whole, n, np.empty(0), series_s, loop.period_s)


def _form(whole: Real, n: int, delays: Real, series_s: float, period_s: float | None) -> DelayForm:
    if not np.isfinite(whole).all() or not np.isfinite(delays).all():
        raise InputError("the loop holds a value that is not finite")
    m = n + delays.size
    M = whole
    if m:
        M, _, _, _, _ = dgebal(whole, scale=1, permute=0)
        M[m, m] = whole[m, m]
    return DelayForm(
        A=M[:n, :n], B1=M[:n, m], B2=M[:n, n:m], C1=M[m, :n], C2=M[n:m, :n], D11=float(M[m, m]),
        D12=M[m, n:m], D21=M[n:m, m], D22=M[n:m, n:m], delays=delays, series_s=series_s, period_s=period_s,
    )  # fmt: skip


def values(form: DelayForm, points: Complex) -> Complex:
    """The loop at any complex points s (or z, where the series delay is exp(-delay log z))."""
    out = np.empty(points.size, dtype=complex)
    for start in range(0, points.size, _CHUNK):
        part = points[start : start + _CHUNK]
        F, lag = _matrix(form, part)
        rhs = np.concatenate((form.B1, form.D21)).astype(complex)
        X = np.linalg.solve(F, rhs[:, None])[..., 0] if rhs.size else np.zeros((part.size, 0))
        out[start : start + _CHUNK] = form.D11 + (_output(form, lag) * X).sum(axis=1)
    exponent = np.log(points) if form.sampled else points
    return out * np.exp(-exponent * form.series)


def border_values(form: DelayForm, x: Real) -> Complex:
    """The loop on the border of stability."""
    return values(form, np.exp(1j * x) if form.sampled else 1j * x)


def evaluate_intervals(form: DelayForm, low: Real, high: Real) -> Intervals:
    """Evaluate the loop in the middle of each interval [low, high], with the bound of its change inside.

    With F(x) X = b the solution inside is X + dX, dX = -F^-1 dF (X + dX) and abs(dF) <= half K entry by
    entry: a Neumann series in a weighted norm bounds dX wherever the interval is short enough.
    """
    parts = [
        _evaluate(form, low[k : k + _CHUNK], high[k : k + _CHUNK]) for k in range(0, max(low.size, 1), _CHUNK)
    ]
    if len(parts) == 1:
        return parts[0]
    return Intervals(
        *(np.concatenate([getattr(p, name) for p in parts]) for name in Intervals.__dataclass_fields__)
    )


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


def _evaluate(form: DelayForm, low: Real, high: Real) -> Intervals:
    x, half = 0.5 * (low + high), 0.5 * (high - low)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        found = _evaluated(form, x, half)
    if not (np.isfinite(found.L).all() and np.isfinite(found.slope).all()):
        raise NumericalError(
            f"the loop overflows double precision between {low[0]:.3g} and {high[-1]:.3g}: a pole there, or "
            "numbers too large"
        )
    return found


def _evaluated(form: DelayForm, x: Real, half: Real) -> Intervals:
    n, q = form.B1.size, form.delays.size
    points = np.exp(1j * x) if form.sampled else 1j * x
    F, lag = _matrix(form, points)
    row = _output(form, lag)
    try:
        inverse = np.linalg.inv(F)
    except np.linalg.LinAlgError as error:
        raise NumericalError(
            f"a pole of the loop lies on the border of stability between {x[0]:.6g} and {x[-1]:.6g}"
        ) from error
    rhs = np.concatenate((form.B1, form.D21))
    X = inverse @ rhs
    Y = (row[:, None, :] @ inverse)[:, 0, :]
    L0 = form.D11 + (row * X).sum(axis=1)
    # derivative: F' = [turn I, j tau B2 lag; 0, j tau D22 lag], row' = [0, -j tau D12 lag]
    turn = 1j * points if form.sampled else np.full(points.shape, 1j)
    late = 1j * form.delays * lag * X[:, n:]
    top = turn[:, None] * X[:, :n] + late @ form.B2.T
    slope0 = -(Y[:, :n] * top).sum(axis=1) - (Y[:, n:] * (late @ form.D22.T)).sum(axis=1) - late @ form.D12
    if form.zeros is not None and form.poles is not None:
        spread = np.abs(L0) * _relative_spread(points, half, form.zeros, form.poles)
    else:
        spread = _spread(form, half, np.abs(inverse), np.abs(X), np.abs(Y), q)
    spread = np.where(np.isfinite(spread), spread, np.inf)  # what overflows is no bound
    back = np.exp(-1j * x * form.series)
    return Intervals(x, half, L0 * back, (slope0 - 1j * form.series * L0) * back, spread)


def _relative_spread(points: Complex, half: Real, zeros: Complex, poles: Complex) -> Real:
    """Bound of |L(x)/L - 1| from the factors: each (p - root) changes by half at most."""
    up = half[:, None] / np.abs(points[:, None] - zeros)
    down = half[:, None] / np.abs(points[:, None] - poles)
    most = np.prod(1.0 + up, axis=1) / np.prod(np.maximum(1.0 - down, 0.0), axis=1)
    return np.where((down < 1.0).all(axis=1), most - 1.0, np.inf)


def _spread(form: DelayForm, half: Real, G: Real, X: Real, Y: Real, q: int) -> Real:
    n = form.B1.size
    K = np.zeros((n + q, n + q))
    K[:n, :n] = np.eye(n)
    K[:n, n:], K[n:, n:] = np.abs(form.B2) * form.delays, np.abs(form.D22) * form.delays
    k = np.concatenate((np.zeros(n), np.abs(form.D12) * form.delays))
    if not n + q:
        return np.zeros(half.size)
    return _series_bound(G @ K, X, Y @ K, k, half)


def _series_bound(GK: Real, X: Real, YK: Real, k: Real, half: Real) -> Real:
    """Bound of abs(dL) from the Neumann series in the norm weighted by a Perron vector; inf: none."""
    u = np.maximum(X, 1e-3 * X.max(axis=1, keepdims=True)) + 1e-300
    for _ in range(3):  # towards the Perron vector, kept positive
        v = (GK @ u[..., None])[..., 0]
        u = u / u.max(axis=1, keepdims=True) + v / (v.max(axis=1, keepdims=True) + 1e-300)
    rho = half * ((GK @ u[..., None])[..., 0] / u).max(axis=1)
    beta = half * ((GK @ X[..., None])[..., 0] / u).max(axis=1)
    gamma = np.where(rho < 1.0, beta / (1.0 - rho), np.inf)
    total = X + gamma[:, None] * u
    spread = half * (YK * total).sum(axis=1) + half * (total @ k)
    return np.where(rho < 1.0, spread, np.inf)
