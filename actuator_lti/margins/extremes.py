"""Smallest distance of the curve to -1 over the whole axis: modulus margin, balanced disk margin."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from actuator_lti.errors import NumericalError
from actuator_lti.margins.level_crossings import LevelCrossings, on_axis, unwarped
from actuator_lti.margins.loop import Complex, RationalLoop, Real

_BELOW = 1e-8  # relative: how much lower a second place may be without being found
_ROUNDS = 30
_NEWTON_STEPS = 12
_NEWTON_STEP = 1e-9
FAR = 1e300  # stands for L at a pole on the end of the axis: T = 1, disk distance 2


@dataclass(frozen=True)
class Criterion:
    """A distance |G(L)| that is to be smallest, and the circle on which it has a given value."""

    distance: Callable[[Complex], Real]
    derivatives: Callable[[complex], tuple[complex, complex, complex]]
    circle: Callable[[float], tuple[float, float, float]]


def _modulus_derivatives(L: complex) -> tuple[complex, complex, complex]:
    return 1.0 + L, 1.0 + 0j, 0j


def _disk_derivatives(L: complex) -> tuple[complex, complex, complex]:
    below = 1.0 - L
    return 2.0 * (1.0 + L) / below, 4.0 / below**2, 8.0 / below**3


def _disk_distance(L: Complex) -> Real:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(L == 1.0, np.inf, np.abs(2.0 * (1.0 + L) / (1.0 - L)))


def _disk_circle(alpha: float) -> tuple[float, float, float]:
    k = 0.25 * alpha * alpha
    return 1.0 - k, 1.0 + k, 1.0 - k


def _complementary_derivatives(L: complex) -> tuple[complex, complex, complex]:
    return 1.0 + 1.0 / L, -1.0 / L**2, 2.0 / L**3


def _complementary_distance(L: Complex) -> Real:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(L == 0.0, np.inf, np.abs((1.0 + L) / L))


def _peak_derivatives(L: complex) -> tuple[complex, complex, complex]:
    return 1.0 / L, -1.0 / L**2, 2.0 / L**3


def _peak_distance(L: Complex) -> Real:
    with np.errstate(divide="ignore"):
        return np.where(L == 0.0, np.inf, 1.0 / np.abs(L))


MODULUS = Criterion(lambda L: np.abs(1.0 + L), _modulus_derivatives, lambda m: (1.0, 1.0, 1.0 - m * m))
DISK = Criterion(_disk_distance, _disk_derivatives, _disk_circle)


def smallest(
    loop: RationalLoop, levels: LevelCrossings, criterion: Criterion, x: Real, L: Complex, top: float
) -> tuple[float, float]:
    """Smallest value of a criterion over the axis and where: a local search, confirmed by eigenvalues.

    Parameters
    ----------
    x, L : arrays
        Points to start from, ends of the axis (x = 0, infinity or pi) included where L is finite there.
    top : float
        End of the axis: infinity or pi.

    Raises
    ------
    NumericalError
        No agreement after 30 rounds.
    """
    value, best = _refined(loop, criterion, x, L, top)
    for _ in range(_ROUNDS):
        if value <= _BELOW:
            return value, best
        zeros = levels.circle(*criterion.circle(value * (1.0 - _BELOW)))
        if zeros is None:
            return value, best
        w = on_axis(zeros).imag
        if not w.size:
            return value, best
        w = np.concatenate((w, np.sqrt(w[1:] * w[:-1])))
        at = unwarped(w, loop.in_z)
        L = loop.response(at)
        if float(criterion.distance(L).min()) >= value * (1.0 - _BELOW):
            return value, best
        value, best = _refined(loop, criterion, at, L, top)
    raise NumericalError("the smallest distance to -1 was not settled: rescale the states of the loop")


def _refined(
    loop: RationalLoop, criterion: Criterion, x: Real, L: Complex, top: float
) -> tuple[float, float]:
    """Newton on the slope of the squared distance from the best of the points given."""
    distance = criterion.distance(L)
    k = int(distance.argmin())
    value, best = float(distance[k]), float(x[k])
    if not 0.0 < best < top or not loop.order:
        return value, best
    at = best
    for _ in range(_NEWTON_STEPS):
        L0, L1, L2 = loop.derivatives(at)
        G, G_L, G_LL = criterion.derivatives(L0)
        G1 = G_L * L1
        G2 = G_L * L2 + G_LL * L1 * L1
        if abs(G) <= value:
            value, best = abs(G), at
        slope = (G.conjugate() * G1).real
        curvature = abs(G1) ** 2 + (G.conjugate() * G2).real
        step = -slope / curvature if curvature > 0.0 else -math.copysign(0.2 * at, slope)
        step = max(min(step, at, 0.5 * (top - at)), -0.5 * at)
        at += step
        if abs(step) <= _NEWTON_STEP * at:
            break
    return value, best


COMPLEMENTARY = Criterion(
    _complementary_distance, _complementary_derivatives, lambda m: (1.0 - m * m, 1.0, 1.0)
)
PEAK = Criterion(_peak_distance, _peak_derivatives, lambda m: (m * m, 0.0, -1.0))
