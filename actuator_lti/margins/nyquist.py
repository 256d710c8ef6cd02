"""Unstable closed-loop poles from the Nyquist curve alone: no grid, no closed-loop poles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.margins.crossings import Crossings
from actuator_lti.margins.loop import Complex, RationalLoop, Real
from actuator_lti.margins.poles import BorderPole, SortedPoles

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
    loop: RationalLoop,
    found: Crossings,
    poles: SortedPoles,
    visible_at_dc: int,
    L_dc: complex,
    L_end: complex,
) -> int:
    """Number of unstable closed-loop poles: open-loop ones less the turns of 1 + L about the origin.

    Between two neighbours among the crossings of the real axis and the poles on the border, 1 + L stays in
    one half plane: the change of its angle follows from the two ends. A pole on the border is passed on the
    unstable side, by a half turn of L for each of its multiplicity (a quarter at both ends of the axis).

    Parameters
    ----------
    visible_at_dc : int
        Multiplicity of the pole at s = 0 (z = 1) in L itself.
    L_dc, L_end : complex
        L at the ends of the axis, where it has no pole there.
    """
    end = loop.end
    inner = [pole for pole in poles.border if 0.0 < pole.x < end]
    stops: list[tuple[float, complex, BorderPole | None]] = [
        (float(x), 1.0 + complex(L), None) for x, L in zip(found.between_x, found.between_L, strict=True)
    ]
    stops += [
        (float(x), 1.0 + complex(L).real, None)
        for x, L, touch in zip(found.real_x, found.real_L, found.real_touch, strict=True)
        if not touch
    ]
    stops += [(pole.x, 0j, pole) for pole in inner]
    stops.sort(key=lambda stop: stop[0])
    angle, last = _start(loop, stops[0], visible_at_dc, L_dc, poles.cloud)
    for k, (x, F, pole) in enumerate(stops):
        if pole is None:
            angle += angle_between(last, F)
            last = F
            continue
        room = min(x - stops[k - 1][0], (stops[k + 1][0] if k + 1 < len(stops) else 2.0 * x) - x)
        before, after = _beside(loop, x, room)
        angle += angle_between(last, before) + angle_about(before, after, -np.pi * pole.multiplicity)
        last = after
    at_end = sum(pole.multiplicity for pole in poles.border if pole.x == end)
    angle += _finish(loop, last, stops[-1][0], at_end, L_end)
    return poles.unstable - round(angle / np.pi)


def angle_between(start: complex, stop: complex) -> float:
    """Angle from one point to another of the same closed half plane, rad."""
    return float(np.angle(stop * np.conj(start)))


def angle_about(start: complex, stop: complex, about: float) -> float:
    """The angle from start to stop that is nearest to ``about``."""
    turn = angle_between(start, stop)
    return turn + 2.0 * np.pi * round((about - turn) / (2.0 * np.pi))


def _start(
    loop: RationalLoop,
    first: tuple[float, complex, BorderPole | None],
    order: int,
    L_dc: complex,
    cloud: float,
) -> tuple[float, complex]:
    if not order:
        return 0.0, 1.0 + L_dc.real
    r = max(1e-2 * first[0], min(10.0 * cloud, 0.5 * first[0]))
    while r > _SMALLEST * first[0]:
        real_point = np.array([np.exp(r) if loop.in_z else r + 0j], dtype=complex)
        on_real, on_axis = complex(loop.at(real_point)[0]), complex(loop.response(np.array([r]))[0])
        if min(abs(on_real), abs(on_axis)) > _FAR:
            return angle_about(1.0 + on_real.real, 1.0 + on_axis, -0.5 * np.pi * order), 1.0 + on_axis
        r *= 0.1
    raise InputError("a pole at zero frequency is cancelled, all but completely: cancel it in the loop first")


def _finish(loop: RationalLoop, last: complex, last_x: float, order: int, L_end: complex) -> float:
    if not order:
        return angle_between(last, 1.0 + L_end.real)
    r = 1e-2 * (np.pi - last_x)
    while r > _SMALLEST:
        on_real = complex(loop.at(np.array([-np.exp(r) + 0j]))[0])
        on_circle = complex(loop.response(np.array([np.pi - r]))[0])
        if min(abs(on_real), abs(on_circle)) > _FAR:
            arc = angle_about(1.0 + on_circle, 1.0 + on_real.real, -0.5 * np.pi * order)
            return angle_between(last, 1.0 + on_circle) + arc
        r *= 0.1
    raise InputError("a pole at z = -1 is cancelled, all but completely: cancel it in the loop first")


def _beside(loop: RationalLoop, x: float, room: float) -> tuple[complex, complex]:
    r = 1e-2 * room
    while r > _SMALLEST * x:
        before, after = 1.0 + loop.response(np.array([x - r, x + r]))
        if min(abs(before), abs(after)) > _FAR:
            return complex(before), complex(after)
        r *= 0.1
    raise InputError(
        f"a pole on the border of stability ({x:.6g}) is cancelled by a zero: the loop says nothing "
        "about it; cancel it in the loop first, or change the design"
    )
