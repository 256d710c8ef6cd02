"""Unstable closed-loop poles from the Nyquist curve alone: no grid, no closed-loop poles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.margins.crossings import Crossings
from actuator_lti.margins.loop import Complex, RationalLoop, Real
from actuator_lti.margins.poles import SortedPoles
from actuator_lti.margins.trust import Doubtful

_FAR = 1e3
_SMALLEST = 1e-13


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


def nyquist_count(
    loop: RationalLoop, crossings: Crossings, poles: SortedPoles, L_dc: complex, L_end: complex
) -> int:
    """Number of unstable closed-loop poles: open-loop ones less the turns of 1 + L about the origin.

    Between two neighbours among the crossings of the real axis 1 + L stays in one half plane: the change of
    its angle follows from the two ends. A pole at zero frequency is passed on the unstable side, by a
    quarter turn of L for each of its multiplicity. There is no other pole on the border.

    Parameters
    ----------
    L_dc, L_end : complex
        L at the ends of the axis; ``L_dc`` where it has no pole there.
    """
    x = np.concatenate((crossings.between_x, crossings.real_x))
    F = 1.0 + np.concatenate((crossings.between_L, crossings.real_L.real))
    F = F[x.argsort()]
    angle, first = 0.0, complex(1.0 + L_dc.real)
    if poles.at_dc:
        angle, first = _start(loop, float(x.min()), poles.at_dc)
    F = np.concatenate(([first], F, [1.0 + L_end.real]))
    angle += float(np.angle(F[1:] * F[:-1].conj()).sum())
    return poles.unstable - round(angle / np.pi)


def angle_between(start: complex, stop: complex) -> float:
    """Angle from one point to another of the same closed half plane, rad."""
    return float(np.angle(stop * np.conj(start)))


def angle_about(start: complex, stop: complex, about: float) -> float:
    """The angle from start to stop that is nearest to ``about``."""
    turn = angle_between(start, stop)
    return turn + 2.0 * np.pi * round((about - turn) / (2.0 * np.pi))


def _start(loop: RationalLoop, first_x: float, order: int) -> tuple[float, complex]:
    """The turn about a pole at zero frequency, and 1 + L where it ends."""
    r = 1e-2 * first_x
    while r > _SMALLEST * first_x:
        real_point = np.array([np.exp(r) if loop.in_z else r + 0j], dtype=complex)
        on_real, on_axis = complex(loop.at(real_point)[0]), complex(loop.response(np.array([r]))[0])
        if min(abs(on_real), abs(on_axis)) > _FAR:
            return angle_about(1.0 + on_real.real, 1.0 + on_axis, -0.5 * np.pi * order), 1.0 + on_axis
        r *= 0.1
    raise Doubtful("a pole at zero frequency hardly shows")
