"""Whether figures in double precision can be trusted: told from zero, with a small bound of their error."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.given import ULP
from actuator_lti.margins.loop import RationalLoop, horner
from actuator_lti.types import Complex, Real

EPS = float(np.finfo(float).eps)
TOUCH = 1e-9  # how near to one (gain) or to the axis (rad) a touching curve counts as touching
MOST_ERROR = 1e-10  # relative bound of the error of L at a crossing


class Doubtful(NumericalError):
    """Double precision cannot check the answer; the message says what it lacks."""


@contextmanager
def in_double_precision() -> Iterator[None]:
    """`Doubtful` where double precision fails on the way."""
    try:
        with np.errstate(all="ignore"):
            yield
    except (InputError, NumericalError):
        raise
    except (ArithmeticError, ValueError, RuntimeError) as error:  # LinAlgError, overflow, no end of a search
        raise Doubtful(f"double precision fails: {error}") from error


def error_bound(loop: RationalLoop, x: Real) -> Real:
    """Relative error of L that one rounding of each entry makes, at arguments of its slopes."""
    points = loop.point(x)
    if loop.coefficients is None:
        return _of_states(loop, points)
    ends = np.isinf(x)
    points[ends] = 1.0
    sizes = rounded_size(loop, points)
    values = horner(loop.coefficients, points)
    values[:, ends] = loop.coefficients[:, :1]
    if loop.in_z_size is not None:
        sizes[:, ends] = loop.in_z_size.sum(axis=1)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return EPS * np.where(sizes > 0.0, sizes / np.abs(values), 0.0).sum(axis=0)


def _of_states(loop: RationalLoop, points: Complex) -> Real:
    """The backward error of the solution carried to L, over abs(L).

    It is eps (abs(Y)' (abs(p) I + abs(A)) abs(X) + abs(c)' abs(X) + abs(Y)' abs(b) + abs(d)) with
    X = (p I - A)^-1 b and Y = (p I - A)^-T c. Zero where nothing is rounded.
    """
    matrix = points[:, None, None] * np.eye(loop.order) - loop.A
    X = np.linalg.solve(matrix, loop.b[:, None].astype(complex))[..., 0]
    y = np.abs(np.linalg.solve(np.swapaxes(matrix, -1, -2), loop.c[:, None].astype(complex))[..., 0])
    x = np.abs(X)
    spread = np.abs(points)[:, None] * x + x @ np.abs(loop.A).T
    bound = (y * spread).sum(-1) + x @ np.abs(loop.c) + y @ np.abs(loop.b) + abs(loop.d)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(bound > 0.0, EPS * bound / np.abs(loop.d + X @ loop.c), 0.0)


def rounded_size(loop: RationalLoop, points: Complex) -> Real:
    """What numerator and denominator would be without any cancellation, shape (2, ...)."""
    if loop.in_z_size is None:
        assert loop.coefficients is not None
        return np.asarray(horner(np.abs(loop.coefficients), np.abs(points)))
    up, down = np.abs(1.0 + points), np.abs(1.0 - points)
    n = loop.order
    k = np.arange(n, -1, -1)[:, None]
    return np.asarray(loop.in_z_size @ (up**k * down ** (n - k)))


def hardly_placed(loop: RationalLoop, poles: Complex, closed: bool) -> bool:
    """Whether rounding of the given coefficients in z may carry a pole across the stability boundary."""
    if loop.in_z_size is None or loop.coefficients is None or not poles.size:
        return False
    p = loop.coefficients.sum(axis=0) if closed else loop.coefficients[1]
    size = rounded_size(loop, poles)
    slope = np.polyval(p[:-1] * np.arange(p.size - 1, 0, -1), poles)
    radius = ULP * EPS * (size.sum(axis=0) if closed else size[1]) / np.abs(slope)
    return not bool((np.abs(poles.real) > radius)[poles != 0.0].all())
