"""Whether figures in double precision can be trusted: told from zero, with a small bound of their error."""

from __future__ import annotations

from typing import Any

import numpy as np

from actuator_lti.errors import NumericalError
from actuator_lti.margins.given import ULP
from actuator_lti.margins.loop import Complex, RationalLoop, Real, horner

EPS = float(np.finfo(float).eps)
ZERO = 1e8  # L of less than so many of its own rounding errors is zero: true zeros gave 8e5 at most
TOUCH = 1e-9  # how near to one (gain) or to the axis (rad) a touching curve counts as touching
MOST_ERROR = 1e-10  # relative bound of the error of L at a crossing


class Doubtful(NumericalError):
    """Double precision cannot check the answer; the message says what it lacks."""


def told_from_zero(A: Any, b: Any, c: Any, d: Any, points: Any) -> Real:
    r"""How many of its own rounding errors L = d + c (p I - A)^-1 b is: below `ZERO` it counts as zero.

    u = abs(L) / (eps (abs(Y)' (abs(p) I + abs(A)) abs(X) + abs(c)' abs(X) + abs(Y)' abs(b) + abs(d))), with
    X = (p I - A)^-1 b and Y = (p I - A)^-T c: the backward error of the solution carried to L.

    Parameters
    ----------
    A, b, c, d : arrays (..., n, n), (..., n), (..., n), (...)
        State spaces; leading axes (designs) broadcast against those of ``points``.
    points : array (...), complex
        s or z, one for each state space.

    Returns
    -------
    array (...)
        u; infinity where nothing is rounded.
    """
    A, b, c = np.asarray(A), np.asarray(b), np.asarray(c)
    points = np.asarray(points, dtype=complex)
    eye = np.eye(A.shape[-1])
    matrix = points[..., None, None] * eye - A
    X = _solved(matrix, b)
    Y = _solved(np.swapaxes(matrix, -1, -2), c)
    L = d + (X * c).sum(axis=-1)
    x, y = np.abs(X), np.abs(Y)
    spread = np.abs(points)[..., None] * x + (np.abs(A) @ x[..., None])[..., 0]
    bound = (y * spread).sum(-1) + (x * np.abs(c)).sum(-1) + (y * np.abs(b)).sum(-1) + np.abs(d)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.abs(L) / (EPS * bound)
    return np.where(bound > 0.0, u, np.inf)


def _solved(matrix: Complex, right: Real) -> Complex:
    full = np.broadcast_to(right, matrix.shape[:-1])
    return np.linalg.solve(matrix, full[..., None].astype(complex))[..., 0]


def error_bound(loop: RationalLoop, x: Real) -> Real:
    """Relative error of L at x that one rounding of each entry makes."""
    if not x.size:
        return np.empty(0)
    points = loop.point(x)
    if loop.numerator is None or loop.denominator is None:
        return 1.0 / told_from_zero(loop.A, loop.b, loop.c, loop.d, points)
    ends = np.isinf(x)
    points[ends] = 1.0
    sizes = rounded_size(loop, points)
    rows = np.array((loop.numerator, loop.denominator))
    values = np.where(ends, rows[:, :1], horner(rows, points))
    if loop.in_z_size is not None:
        sizes[:, ends] = loop.in_z_size.sum(axis=1)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return EPS * np.where(sizes > 0.0, sizes / np.abs(values), 0.0).sum(axis=0)


def rounded_size(loop: RationalLoop, points: Complex) -> Real:
    """What numerator and denominator would be without any cancellation, shape (2, ...)."""
    assert loop.numerator is not None
    assert loop.denominator is not None
    if loop.in_z_size is None:
        return np.asarray(horner(np.abs((loop.numerator, loop.denominator)), np.abs(points)))
    up, down = np.abs(1.0 + points), np.abs(1.0 - points)
    n = loop.order
    k = np.arange(n, -1, -1)[:, None]
    return np.asarray(loop.in_z_size @ (up**k * down ** (n - k)))


def hardly_placed(loop: RationalLoop, poles: Complex, closed: bool) -> bool:
    """Whether rounding of the given coefficients in z may carry a pole across the stability boundary."""
    if loop.in_z_size is None or loop.numerator is None or loop.denominator is None or not poles.size:
        return False
    p = loop.denominator + loop.numerator if closed else loop.denominator
    size = rounded_size(loop, poles)
    slope = np.polyval(p[:-1] * np.arange(p.size - 1, 0, -1), poles)
    radius = ULP * EPS * (size.sum(axis=0) if closed else size[1]) / np.abs(slope)
    return not bool((np.abs(poles.real) > radius)[poles != 0.0].all())
