"""The rational loop in the form in which all margins are found: a balanced state space, behind a delay."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgebal

from actuator_lti.errors import NumericalError
from actuator_lti.margins.given import Given, given_of, unwarped
from actuator_lti.systems.resolvent import LARGE, states_at
from actuator_lti.types import Complex, Real

_AT_MINUS_ONE = 1e-13


@dataclass(frozen=True)
class RationalLoop:
    """L = d + c (p I - A)^-1 b with p = s or z, real and balanced, behind a delay.

    Frequencies are ``w`` of the s-plane: s = j w, of a sampled loop s = (z - 1)/(z + 1), w = tan(angle/2). A
    sampled loop that was given by coefficients is held there, to which these are brought exactly. The
    argument ``x`` of its slopes is w, or, where the matrices are those of z, the angle in rad, 0 to pi.
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
    delay: float = 0.0  # behind it: s, or samples

    @property
    def order(self) -> int:
        return self.b.size

    def behind(self, delay_s: float) -> RationalLoop:
        delay = delay_s / (self.period_s or 1.0)
        return self if delay == self.delay else replace(self, delay=delay)

    def frequency(self, w: float) -> float:
        """Angular frequency in rad/s."""
        return unwarped(w, self.period_s)

    def x(self, w: Real) -> Real:
        """The argument of slopes."""
        return 2.0 * np.arctan(w) if self.in_z else w

    def point(self, x: Real) -> Complex:
        """Point of the stability boundary: j x, or exp(j x)."""
        return np.exp(1j * x) if self.in_z else 1j * x

    def at(self, w: Real) -> Complex:
        """L at w."""
        x = self.x(w)
        return self.late(x, self._values(self._variable(x)))

    def beside_zero(self, w: float) -> tuple[float, complex]:
        """L without the delay at a real s = w next to zero, and L at j w."""
        x = self.x(np.array([w]))
        L = self._values(self._variable(np.concatenate((x, -1j * x))))
        return float(L[1].real), complex(self.late(x, L[:1])[0])

    def at_rest(self) -> complex:
        """L at zero frequency; by matrices refined once, so that states which are 0 there add no rounding."""
        if self.coefficients is None:
            matrix = self._resolvent(self._variable(np.zeros(1)))[0].real
            x = np.linalg.solve(matrix, self.b)
            return complex(self.d + self.c @ (x + np.linalg.solve(matrix, self.b - matrix @ x)))
        if self.in_z:
            return complex(self._values(self._variable(np.zeros(1)))[0].real)
        above, below = self.coefficients[:, -1]
        return complex(above / below)

    def at_end(self) -> complex:
        """L at the end of the axis: at infinity, or at Nyquist with the whole delay."""
        if self.period_s is None:
            return complex(self.d)
        end = complex(self._values(self._variable(np.array([math.pi])))[0].real) if self.in_z else self.d
        return end * complex(np.exp(-1j * math.pi * self.delay)) if self.delay else complex(end)

    def late(self, x: Real, L: Complex) -> Complex:
        """L at x behind the delay, from that without."""
        if not self.delay:
            return L
        angle = x if self.period_s is None or self.in_z else 2.0 * np.arctan(x)
        return L * np.exp(-1j * self.delay * angle)

    def late_rate(self, x: Real, rate: Complex) -> Complex:
        """d log L/dx behind the delay, from that without."""
        if not self.delay:
            return rate
        turning = 1.0 if self.period_s is None or self.in_z else 2.0 / (1.0 + x * x)
        return rate - 1j * self.delay * turning

    def rate_at_end(self) -> complex:
        """d log L/d angle at the Nyquist frequency, behind the delay."""
        if self.in_z:
            L, slope = self.response_and_slope(np.array([math.pi]))
            return complex(slope[0] / L[0]) - 1j * self.delay
        assert self.coefficients is not None
        if not self.order:
            return -1j * self.delay
        above, below = self.coefficients  # in u = 1/w: angle = pi - 2 u, s = j/u
        rate = (above[1] / above[0] - below[1] / below[0]) / 1j if above[0] else math.inf
        return -0.5 * complex(rate) - 1j * self.delay

    def response_and_slope(self, x: Real) -> tuple[Complex, Complex]:
        """L without the delay and dL/dx = j dL/ds (continuous) or j z dL/dz (sampled), c (x I - A)^-2 b."""
        p = self._variable(x)
        turn = 1j * self.point(x) if self.in_z else 1j
        if self.coefficients is not None:
            above, below, d_above, d_below = horner(self._with_slopes, p)
            L = above / below
            return L, turn * (d_above / below - L * (d_below / below))
        matrix = self._resolvent(p)
        first = np.linalg.solve(matrix, self.b[:, None])
        second = np.linalg.solve(matrix, first)
        return self.d + first[..., 0] @ self.c, -turn * (second[..., 0] @ self.c)

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

    @property
    def _state(self) -> Real:
        return self.A - np.eye(self.order) if self.in_z else self.A

    def _values(self, p: Complex) -> Complex:
        if self.coefficients is not None:
            with np.errstate(all="ignore"):
                above, below = horner(self._with_slopes[:2], p)
                return np.asarray(above / below)
        if min(self.order, p.size) >= LARGE:
            states = states_at(self._state, self.b[:, None], p)
        else:
            states = np.linalg.solve(self._resolvent(p), self.b[:, None])
        return np.asarray(self.d + states[..., 0] @ self.c)

    def _resolvent(self, p: Complex) -> Complex:
        n = self.order
        matrix = np.empty((p.size, n, n), dtype=complex)
        matrix[:] = -self._state
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
        late = np.concatenate((given.denominator, np.zeros(given.samples)))  # the samples as poles at z = 0
        return _from_coefficients(given.numerator, late, given.period_s, warp)
    n, samples = given.b.size, given.samples
    if not samples:
        return _from_matrices(given.A, given.b, given.c, given.d, given.period_s)
    one = _from_matrices(given.A, given.b, given.c, given.d, given.period_s)
    A, b, c = np.zeros((n + samples, n + samples)), np.zeros(n + samples), np.zeros(n + samples)
    A[:n, :n], A[n, :n], A[n + 1 :, n:-1] = one.A, one.c, np.eye(samples - 1)
    b[:n], b[n], c[-1] = one.b, one.d, 1.0
    return _from_matrices(A, b, c, 0.0, given.period_s)


def _from_matrices(
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


def _from_coefficients(num: Real, den: Real, period_s: float | None, warp: bool) -> RationalLoop:
    """Companion form of num/den (highest power first), which is exact, then balanced."""
    n = den.size - 1
    if warp and period_s is not None and n:
        warped_den = warped_coefficients(den, n)
        if abs(warped_den[0]) > _AT_MINUS_ONE * np.abs(den).sum():
            loop = _from_coefficients(warped_coefficients(num, n), warped_den, None, False)
            size = np.zeros((2, n + 1))
            size[0, n + 1 - num.size :], size[1] = np.abs(num / warped_den[0]), np.abs(den / warped_den[0])
            return replace(loop, period_s=period_s, in_z_size=size)
    coefficients = np.zeros((2, n + 1))
    with np.errstate(over="ignore"):
        coefficients[0, n + 1 - num.size :], coefficients[1] = num / den[0], den / den[0]
    if not np.isfinite(coefficients).all():
        raise NumericalError("the loop overflows double precision: rescale its coefficients")
    (d, *above), below = coefficients[0].tolist(), coefficients[1, 1:]
    A = np.eye(n, k=-1)
    A[:1] = -below
    b = np.zeros(n)
    b[:1] = 1.0
    return _from_matrices(A, b, above - d * below, d, period_s, coefficients)


def warped_coefficients(p: Real, degree: int) -> Real:
    """Coefficients of (1 - s)^degree p((1 + s)/(1 - s)), computed exactly and rounded once.

    Poles and zeros near z = 1, where those of a fast sampled loop crowd, keep their relative accuracy.
    """
    from flint import fmpz_poly  # only where a sampled loop is asked for

    from actuator_lti.margins.exact.loop import integers
    from actuator_lti.margins.exact.roots import warped

    (whole,), shift = integers(p)
    about = [int(c) for c in warped(fmpz_poly(whole[::-1]), degree).coeffs()]
    return np.array([c / (1 << shift) for c in [0] * (degree + 1 - len(about)) + about[::-1]])


def balanced(whole: Real) -> Real:
    """Scaled by powers of two so that rows and columns weigh the same; the last ones as they are."""
    scaled, _, _, scale, _ = dgebal(whole, scale=1, permute=0)
    n = scale.size - 1
    scaled[n, n] = whole[n, n]
    return scaled
