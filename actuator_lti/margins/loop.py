"""The rational loop in the form in which all margins are found: a balanced state space."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgebal

from actuator_lti.margins.given import Given, Real, given_of, unwarped

Complex = NDArray[np.complexfloating[Any, Any]]
Mask = NDArray[np.bool_]
_AT_MINUS_ONE = 1e-13
_REFINEMENTS = 1


@dataclass(frozen=True)
class RationalLoop:
    """L = d + c (p I - A)^-1 b with p = s or z, real and balanced.

    The argument of every response is ``x``: in the s-plane the angular frequency (s = j x), in the z-plane
    the angle in rad, 0 to pi (z = exp(j x)). A sampled loop that was given by coefficients is held in the
    s-plane of s = (z - 1)/(z + 1), to which its coefficients are brought exactly; x is tan(angle/2) then.
    """

    A: Real  # (n, n): state space, scaled by a diagonal similarity so that rows and columns weigh the same
    b: Real
    c: Real
    d: float
    period_s: float | None  # sampling period, ``None`` for a continuous loop
    in_z: bool = False  # whether the matrices are those of the z-plane
    # numerator and denominator, shape (2, n + 1), highest power first, where the loop was given by them: they
    # are then evaluated directly
    coefficients: Real | None = None
    # of a loop brought from z: the sizes of the coefficients that it was given by, in the same unit. Their
    # rounding is the accuracy of the data
    in_z_size: Real | None = None

    @property
    def order(self) -> int:
        """Number of states."""
        return self.b.size

    @property
    def end(self) -> float:
        """The end of the axis: infinity, or pi in the z-plane."""
        return math.pi if self.in_z else math.inf

    def frequency(self, x: float) -> float:
        """Angular frequency in rad/s for x."""
        return float(x) / self.period_s if self.in_z and self.period_s else unwarped(x, self.period_s)

    def point(self, x: Real) -> Complex:
        """Point of the stability boundary: j x, or exp(j x)."""
        return np.exp(1j * x) if self.in_z else 1j * x

    def at(self, points: Any) -> Any:
        """L at any points s or z, shape kept (1-D), in real arithmetic where they are real."""
        return self._values(points - 1.0 if self._about_one else points)

    def response(self, x: Real) -> Complex:
        """L on the stability boundary."""
        return self._values(self._variable(x))

    def response_and_slope(self, x: Real) -> tuple[Complex, Complex]:
        """L and dL/dx = j dL/ds (continuous) or j z dL/dz (sampled), from c (x I - A)^-2 b."""
        p = self._variable(x)
        turn = 1j * self.point(x) if self.in_z else 1j
        if self.coefficients is not None:
            above, below, d_above, d_below = horner(self._with_slopes, p)
            L = above / below
            return L, turn * (d_above / below - L * (d_below / below))
        if self.order == 0:
            return np.full(p.shape, self.d, dtype=complex), np.zeros(p.shape, dtype=complex)
        matrix: Complex = self._resolvent(p)
        first = np.linalg.solve(matrix, self.b[:, None])
        second = np.linalg.solve(matrix, first)
        response: Complex = self.d + first[..., 0] @ self.c
        return response, -turn * (second[..., 0] @ self.c)

    def sharp_response(self, x: Real) -> Complex:
        """L on the border, with the residual of the solution in extended precision."""
        wide = np.asarray(x, dtype=np.longdouble) * 1j
        p = np.expm1(wide) if self._about_one else np.exp(wide) if self.in_z else wide
        if self.coefficients is not None:
            above, below = horner(np.asarray(self.coefficients, np.longdouble), p)
            return np.asarray((above / below).astype(complex))
        if self.order == 0:
            return np.full(p.shape, self.d, dtype=complex)
        A = np.asarray(self._state(), np.longdouble)
        matrix = self._resolvent(p.astype(complex))
        X = np.zeros((p.size, self.order), dtype=np.clongdouble)
        for _ in range(_REFINEMENTS + 1):
            residual = self.b - p[:, None] * X + X @ A.T
            X = X + np.linalg.solve(matrix, residual.astype(complex)[..., None])[..., 0]
        return (X @ np.asarray(self.c, np.longdouble) + self.d).astype(complex)

    def delayed(self, samples: int) -> RationalLoop:
        """The loop behind whole samples of delay (z-plane only), each a further state."""
        n = self.order
        A = np.zeros((n + samples, n + samples))
        A[:n, :n], A[n, :n] = self.A, self.c
        A[n + 1 :, n:-1] = np.eye(samples - 1)
        b, c = np.zeros(n + samples), np.zeros(n + samples)
        b[:n], b[n], c[-1] = self.b, self.d, 1.0
        return from_matrices(A, b, c, 0.0, self.period_s)

    @cached_property
    def _with_slopes(self) -> Complex:
        """Numerator, denominator and their derivatives, complex as where they are asked."""
        assert self.coefficients is not None
        rows = np.zeros((4, self.order + 1), dtype=complex)
        rows[:2] = self.coefficients
        rows[2:, 1:] = rows[:2, :-1] * np.arange(rows.shape[1] - 1, 0, -1)
        return rows

    def _variable(self, x: Real) -> Complex:
        """The number that stands on the diagonal: s, or z - 1, exact near z = 1."""
        return np.expm1(1j * x) if self._about_one else self.point(x)

    @property
    def _about_one(self) -> bool:
        return self.in_z and self.coefficients is None

    def _state(self) -> Real:
        return self.A - np.eye(self.order) if self.in_z else self.A

    def _values(self, p: Any) -> Any:
        if self.coefficients is not None:
            with np.errstate(all="ignore"):
                above, below = horner(self._with_slopes[:2] if np.iscomplexobj(p) else self.coefficients, p)
                return above / below
        if self.order == 0:
            return np.full(p.shape, self.d, dtype=p.dtype)
        return self.d + np.linalg.solve(self._resolvent(p), self.b[:, None])[..., 0] @ self.c

    def _resolvent(self, p: Any) -> Any:
        n = self.order
        matrix = np.empty((p.size, n, n), dtype=p.dtype)
        matrix[:] = -self._state()
        index = np.arange(n)
        matrix[:, index, index] += p[:, None]
        return matrix


def horner(rows: Real | Complex, p: Any) -> Any:
    """Values of polynomials (k, n + 1), highest power first, at points; shape (k, points)."""
    first, *columns = rows.T[:, :, None]
    value = first + 0.0 * p
    for column in columns:
        value *= p
        value += column
    return value


def rational_loop(system: Any) -> RationalLoop:
    """Bring a SISO python-control state space or transfer function into the form of the engine.

    `InputError`: more than one input or output, improper, or a value that is not finite.
    """
    return loop_of(given_of(system))


def loop_of(given: Given, warp: bool = False) -> RationalLoop:
    """The same from the given doubles.

    ``warp`` holds a sampled transfer function in the plane of (z - 1)/(z + 1), unless it has a pole at -1.
    """
    if given.A is None:
        late = given.behind_samples()
        return from_coefficients(late.numerator, late.denominator, given.period_s, warp)
    loop = from_matrices(given.A, given.b, given.c, given.d, given.period_s)
    return loop.delayed(given.samples) if given.samples else loop


def from_matrices(
    A: Real, b: Real, c: Real, d: float, period_s: float | None, coefficients: Real | None = None
) -> RationalLoop:
    """Balance a state space; shapes (n, n), (n,), (n,)."""
    n = b.size
    whole: Real = np.empty((n + 1, n + 1))
    whole[:n, :n], whole[:n, n], whole[n, :n], whole[n, n] = A, b, c, d
    if n:
        whole = balanced(whole)
    parts = (whole[:n, :n], whole[:n, n], whole[n, :n])
    return RationalLoop(*parts, d, period_s, period_s is not None, coefficients)


def from_coefficients(num: Real, den: Real, period_s: float | None, warp: bool = False) -> RationalLoop:
    """Companion form of num/den (highest power first), which is exact, then balanced."""
    n = den.size - 1
    if warp and period_s is not None and n:
        warped_den = warped_coefficients(den, n)
        if abs(warped_den[0]) > _AT_MINUS_ONE * np.abs(den).sum():
            loop = from_coefficients(warped_coefficients(num, n), warped_den, None)
            size = np.zeros((2, n + 1))
            size[0, n + 1 - num.size :], size[1] = np.abs(num / warped_den[0]), np.abs(den / warped_den[0])
            return replace(loop, period_s=period_s, in_z_size=size)
    coefficients = np.zeros((2, n + 1))
    coefficients[0, n + 1 - num.size :], coefficients[1] = num / den[0], den / den[0]
    (d, *above), below = coefficients[0].tolist(), coefficients[1, 1:]
    A = np.eye(n, k=-1)
    A[:1] = -below
    b = np.zeros(n)
    b[:1] = 1.0
    return from_matrices(A, b, above - d * below, d, period_s, coefficients)


def warped_coefficients(p: Real, degree: int) -> Real:
    """Coefficients of (1 - s)^degree p((1 + s)/(1 - s)), computed exactly and rounded once.

    Poles and zeros near z = 1, where those of a fast sampled loop crowd, keep their relative accuracy.
    """
    from flint import fmpz_poly  # only where a sampled loop is asked for

    from actuator_lti.margins.exact.loop import integers, warped

    (whole,), shift = integers(p)
    about = [int(c) for c in warped(fmpz_poly(whole[::-1]), degree).coeffs()]
    return np.array([c / (1 << shift) for c in [0] * (degree + 1 - len(about)) + about[::-1]])


def balanced(whole: Real) -> Real:
    """Scaled by powers of two so that rows and columns weigh the same; the last ones as they are."""
    scaled, _, _, scale, _ = dgebal(whole, scale=1, permute=0)
    n = scale.size - 1
    scaled[n, n] = whole[n, n]
    return scaled
