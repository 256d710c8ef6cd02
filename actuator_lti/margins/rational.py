"""Extremes of a rational loop over the axis: peak, smallest |S| and |T|."""

from __future__ import annotations

import math

import numpy as np

from actuator_lti.margins.extremes import FAR, Criterion, smallest
from actuator_lti.margins.level_crossings import LevelCrossings
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.margins.poles import sorted_poles


def rational_extreme(
    loop: RationalLoop, criterion: Criterion, at_rest: complex | None = None
) -> tuple[float, float]:
    """Smallest value of a criterion over the whole axis, ends included, and where (x of `RationalLoop`).

    ``at_rest`` is the response at zero frequency where a mode there, that it does not show, hides it.
    """
    if not loop.order:
        return float(criterion.distance(np.array([loop.d + 0j]))[0]), 0.0
    poles = sorted_poles(loop.A, loop.in_z, gather=True)
    end_x = loop.end
    size = np.abs(np.angle(poles.values)) if loop.in_z else np.abs(poles.values)
    around = size[(size > 1e-9 * size.max()) & (size < end_x)] if size.size else size
    x = np.concatenate((around * 0.7, np.minimum(around * 1.4, 0.5 * (around + min(end_x, 1e300)))))
    L = loop.response(x)
    x, L = np.append(x, end_x), np.append(L, loop.response(np.array([math.pi])) if loop.in_z else loop.d)
    at_dc = any(pole.x == 0.0 for pole in poles.border)
    start = at_rest if at_rest is not None else FAR if at_dc else loop.response(np.zeros(1))
    x, L = np.append(x, 0.0), np.append(L, start)
    return smallest(loop, LevelCrossings(loop, poles.values), criterion, x, L, end_x)
