"""Distances of a response L whose smallest value is asked for: to -1, and those that peaks are one over."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from actuator_lti.margins.loop import Complex, Real

FAR = 1e300  # stands for L at a pole on the end of the axis: T = 1, disk distance 2
Distance = Callable[[Complex], Real]


def modulus(L: Complex) -> Real:
    """|1 + L|, one over |S|."""
    return np.abs(1.0 + L)


def disk(L: Complex) -> Real:
    """|2 (1 + L)/(1 - L)|, of the balanced disk margin."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(L == 1.0, np.inf, np.abs(2.0 * (1.0 + L) / (1.0 - L)))


def complementary(L: Complex) -> Real:
    """|(1 + L)/L|, one over |T|."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(L == 0.0, np.inf, np.abs((1.0 + L) / L))


def inverse(L: Complex) -> Real:
    """1/|L|, one over the gain."""
    with np.errstate(divide="ignore"):
        return np.where(L == 0.0, np.inf, 1.0 / np.abs(L))
