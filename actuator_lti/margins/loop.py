"""The rational loop in the form in which all margins are found: a balanced state space."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgebal, zgetrf, zgetrs

from actuator_lti.errors import InputError

Real = NDArray[np.floating[Any]]
Complex = NDArray[np.complexfloating[Any, Any]]
Mask = NDArray[np.bool_]
_AT_MINUS_ONE = 1e-13


@dataclass(frozen=True)
class RationalLoop:
    """L = d + c (p I - A)^-1 b with p = s or z, real and balanced.

    The argument of every response is ``x``: in the s-plane the angular frequency (s = j x), in the z-plane
    the angle in rad, 0 to pi (z = exp(j x)). A sampled loop that was given by coefficients is held in the
    s-plane of s = (z - 1)/(z + 1), to which its coefficients are brought exactly; x is tan(angle/2) then.

    Attributes
    ----------
    A, b, c, d : arrays (n, n), (n,), (n,) and float
        State space, scaled by a diagonal similarity so that rows and columns weigh the same.
    period_s : float or None
        Sampling period, ``None`` for a continuous loop.
    in_z : bool
        Whether the matrices are those of the z-plane.
    numerator, denominator : array or None
        Coefficients, where the loop was given by them: they are then evaluated directly.
    """

    A: Real
    b: Real
    c: Real
    d: float
    period_s: float | None
    in_z: bool = False
    numerator: Real | None = None
    denominator: Real | None = None

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
        if self.period_s is None:
            return float(x)
        return float(x if self.in_z else 2.0 * math.atan(x)) / self.period_s

    def point(self, x: Real) -> Complex:
        """Point of the border of stability: j x, or exp(j x)."""
        return np.exp(1j * x) if self.in_z else 1j * x

    def at(self, points: Complex) -> Complex:
        """L at any complex points s or z, shape kept (1-D)."""
        if self.numerator is not None and self.denominator is not None:
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.polyval(self.numerator, points) / np.polyval(self.denominator, points)
        if self.order == 0:
            return np.full(points.shape, self.d, dtype=complex)
        return self.d + np.linalg.solve(self._resolvent(points), self.b[:, None])[..., 0] @ self.c

    def response(self, x: Real) -> Complex:
        """L on the border of stability."""
        return self.at(self.point(x))

    def response_and_slope(self, x: Real) -> tuple[Complex, Complex]:
        """L and dL/dx = j dL/ds (continuous) or j z dL/dz (sampled), from c (x I - A)^-2 b."""
        points = self.point(x)
        turn = 1j * points if self.in_z else 1j
        if self.numerator is not None and self.denominator is not None:
            num, den = self.numerator, self.denominator
            below = np.polyval(den, points)
            L = np.polyval(num, points) / below
            d_num = np.polyval(num[:-1] * np.arange(num.size - 1, 0, -1), points)
            d_den = np.polyval(den[:-1] * np.arange(den.size - 1, 0, -1), points)
            return L, turn * (d_num / below - L * (d_den / below))
        if self.order == 0:
            return np.full(points.shape, self.d, dtype=complex), np.zeros(points.shape, dtype=complex)
        matrix = self._resolvent(points)
        first = np.linalg.solve(matrix, self.b[:, None])
        second = np.linalg.solve(matrix, first)
        return self.d + first[..., 0] @ self.c, -turn * (second[..., 0] @ self.c)

    def jet(self, x: float) -> tuple[complex, complex, complex]:
        """L and its first two derivatives by x at one point."""
        point = cmath.exp(1j * x) if self.in_z else 1j * x
        if self.order == 0:
            return complex(self.d), 0j, 0j
        lu, pivots, _ = zgetrf(self._resolvent(np.array([point]))[0], overwrite_a=1)
        first = zgetrs(lu, pivots, self.b)[0]
        second = zgetrs(lu, pivots, first)[0]
        third = zgetrs(lu, pivots, second)[0]
        L = complex(self.d + first @ self.c)
        d_point, dd_point = -complex(second @ self.c), 2.0 * complex(third @ self.c)
        if self.in_z:
            return L, 1j * point * d_point, -point * (d_point + point * dd_point)
        return L, 1j * d_point, -dd_point

    def delayed(self, samples: int) -> RationalLoop:
        """The loop behind whole samples of delay (z-plane only), each a further state."""
        n = self.order
        A = np.zeros((n + samples, n + samples))
        A[:n, :n], A[n, :n] = self.A, self.c
        A[n + 1 :, n:-1] = np.eye(samples - 1)
        b, c = np.zeros(n + samples), np.zeros(n + samples)
        b[:n], b[n], c[-1] = self.b, self.d, 1.0
        return from_matrices(A, b, c, 0.0, self.period_s)

    def _resolvent(self, points: Complex) -> Complex:
        n = self.order
        matrix = np.empty((points.size, n, n), dtype=complex)
        matrix[:] = -self.A
        index = np.arange(n)
        matrix[:, index, index] += points[:, None]
        return matrix


def rational_loop(system: Any, warp: bool = False) -> RationalLoop:
    """Bring a SISO python-control state space or transfer function into the form of the engine.

    Parameters
    ----------
    system : StateSpace or TransferFunction
        One input, one output.
    warp : bool
        Hold a sampled transfer function in the s-plane of s = (z - 1)/(z + 1), unless it has a pole at -1.

    Raises
    ------
    InputError
        More than one input or output, an improper transfer function, or a value that is not finite.
    """
    if system.ninputs != 1 or system.noutputs != 1:
        raise InputError(
            f"a loop has one input and one output; this has {system.ninputs} and {system.noutputs}"
        )
    period_s = _period(system.dt)
    if hasattr(system, "num"):
        num = np.trim_zeros(np.asarray(system.num[0][0], dtype=float), "f")
        den = np.trim_zeros(np.asarray(system.den[0][0], dtype=float), "f")
        return from_coefficients(num, den, period_s, warp)
    A = np.asarray(system.A, dtype=float)
    b = np.asarray(system.B, dtype=float)[:, 0]
    c = np.asarray(system.C, dtype=float)[0]
    return from_matrices(A, b, c, float(system.D[0, 0]), period_s)


def from_matrices(A: Real, b: Real, c: Real, d: float, period_s: float | None) -> RationalLoop:
    """Balance a state space; shapes (n, n), (n,), (n,)."""
    n = b.size
    whole: Real = np.empty((n + 1, n + 1))
    whole[:n, :n], whole[:n, n], whole[n, :n], whole[n, n] = A, b, c, d
    if not np.isfinite(whole).all():
        raise InputError("the loop holds a value that is not finite")
    if n:
        whole = _balanced(whole)
    return RationalLoop(whole[:n, :n], whole[:n, n], whole[n, :n], d, period_s, period_s is not None)


def from_coefficients(num: Real, den: Real, period_s: float | None, warp: bool = False) -> RationalLoop:
    """Companion form of num/den (highest power first), which is exact, then balanced."""
    if not den.size:
        raise InputError("the denominator of the loop is zero")
    if num.size > den.size:
        raise InputError(
            f"the loop is improper (numerator of degree {num.size - 1} over {den.size - 1}): "
            "it needs at least as many poles as zeros"
        )
    n = den.size - 1
    if warp and period_s is not None and n and np.isfinite(num).all() and np.isfinite(den).all():
        warped_den = warped_coefficients(den, n)
        if abs(warped_den[0]) > _AT_MINUS_ONE * np.abs(den).sum():
            loop = from_coefficients(warped_coefficients(num, n), warped_den, None)
            return replace(loop, period_s=period_s)
    above = np.zeros(n + 1)
    above[n + 1 - num.size :] = num / den[0]
    below = den / den[0]
    A = np.zeros((n, n))
    if n:
        A[0] = -below[1:]
        A[np.arange(1, n), np.arange(n - 1)] = 1.0
    b = np.zeros(n)
    b[:1] = 1.0
    d = float(above[0])
    loop = from_matrices(A, b, above[1:] - d * below[1:], d, period_s)
    return replace(loop, numerator=above, denominator=below)


def warped_coefficients(p: Real, degree: int) -> Real:
    """Coefficients of (1 - s)^degree p((1 + s)/(1 - s)), computed exactly and rounded once.

    Poles and zeros near z = 1, where those of a fast sampled loop crowd, keep their relative accuracy.
    """
    ratios = [float(c).as_integer_ratio() for c in p]
    common = max(below for _, below in ratios)
    total, power = [0], [1]  # lowest power first
    for k in range(degree + 1):  # Horner in z, homogeneous: total (1 + s) + coefficient (1 - s)^k
        at = k - (degree + 1 - len(ratios))
        total = [a + b for a, b in zip([*total, 0], [0, *total], strict=True)]
        if at >= 0:
            coefficient = ratios[at][0] * (common // ratios[at][1])
            total = total[: k + 1] if k + 1 < len(total) else total + [0] * (k + 1 - len(total))
            total = [a + coefficient * b for a, b in zip(total, power, strict=True)]
        power = [a - b for a, b in zip([*power, 0], [0, *power], strict=True)]
    total = (total + [0] * (degree + 1))[: degree + 1]
    return np.array([c / common for c in reversed(total)])


def _balanced(whole: Real) -> Real:
    scaled, _, _, scale, _ = dgebal(whole, scale=1, permute=0)
    n = scale.size - 1
    scaled[n, n] = whole[n, n]
    return scaled


def _period(dt: Any) -> float | None:
    if dt is None or (dt == 0 and dt is not True):
        return None
    return 1.0 if dt is True else float(dt)
