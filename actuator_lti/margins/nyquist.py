"""Angles along the Nyquist curve, and its start at a pole at zero frequency."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.margins.loop import Complex, Real


def slope_at_dc(response: Callable[[Real], Complex], start: float, most: int) -> tuple[int, complex]:
    """Order of the pole of L at zero frequency, from the steepest whole slope below ``start``, and L there.

    Parameters
    ----------
    response : callable
        L on the border of stability.
    start : float
        Below every other pole.
    most : int
        Poles that there are.

    Raises
    ------
    InputError
        No slope is a whole number: the pole is all but cancelled.
    """
    x = start * 10.0 ** (-0.5 * np.arange(20))
    L = response(x)
    with np.errstate(divide="ignore", invalid="ignore"):  # where L is 0 there is no slope
        slope = 2.0 * np.log10(np.abs(L[1:]) / np.abs(L[:-1]))
        whole = np.flatnonzero((np.abs(slope - np.round(slope)) < 0.01) & (np.round(slope) <= most))
    if not whole.size:
        raise InputError(
            "a pole at zero frequency is cancelled, all but completely: cancel it in the loop first"
        )
    order = int(np.round(slope[whole]).max())
    steepest = whole[np.round(slope[whole]) == order]
    k = int(steepest[steepest.size // 2])
    return max(order, 0), complex(L[k + 1])


def angle_between(start: complex, stop: complex) -> float:
    """Angle from one point to another of the same closed half plane, rad."""
    return float(np.angle(stop * np.conj(start)))


def angle_about(start: complex, stop: complex, about: float) -> float:
    """The angle from start to stop that is nearest to ``about``."""
    turn = angle_between(start, stop)
    return turn + 2.0 * np.pi * round((about - turn) / (2.0 * np.pi))
