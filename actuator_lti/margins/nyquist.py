"""Turns of 1 + L about the origin along the axis, from the crossings of the negative real axis."""

from __future__ import annotations

import cmath
import math

import numpy as np

from actuator_lti.margins.axis_parts import Part
from actuator_lti.margins.axis_search import Found
from actuator_lti.margins.factored import Response
from actuator_lti.margins.factors_on_axis import Factored
from actuator_lti.margins.loop import Complex, Mask


def half_turns_about(
    factors: Factored,
    response: Response,
    parts: list[Part],
    ends: tuple[complex, complex],
    real_L: Complex,
    rising: Mask,
) -> int:
    """Turns of 1 + L about the origin from zero frequency to the end of the axis, in half turns."""
    around = np.abs(real_L) > 1.0
    cut = int(np.count_nonzero(rising & around)) - int(np.count_nonzero(~rising & around))
    cut += sum(part.found.turns for part in parts)
    angle, first = _from_zero(factors, response, parts[0].found, ends[0])
    more, last = _to_end(response, parts[-1], ends[1])
    return round((angle + last - first + more) / math.pi) + 2 * cut


def _from_zero(factors: Factored, response: Response, found: Found, dc: complex) -> tuple[float, float]:
    """The turn of 1 + L up to just above zero frequency, and its angle there."""
    if not factors.at_zero < 0.0:
        return 0.0, _leaving(1.0 + dc.real, found)
    low = float(found.known[0, 0])
    on_real, on_axis = response.real_point(low), complex(response.at(np.array([low]))[0])
    turn, about = _angle_between(1.0 + on_real, 1.0 + on_axis), 0.5 * math.pi * factors.at_zero
    turn += 2.0 * math.pi * round((about - turn) / (2.0 * math.pi))
    return turn, cmath.phase(1.0 + on_axis)


def _angle_between(start: complex, stop: complex) -> float:
    """Angle from one point to another of the same closed half plane."""
    return cmath.phase(stop * start.conjugate())


def _leaving(F: float, found: Found) -> float:
    """The angle of 1 + L beside an end of the axis, where it is F."""
    if F >= 0.0:
        return 0.0
    return -math.pi if found.rate > 0.0 else math.pi


def _to_end(response: Response, part: Part, end: complex) -> tuple[float, float]:
    """The turn of 1 + L onto the real axis at the end, and its angle before."""
    F = 1.0 + end
    if response.delay:
        return _angle_between(F, complex(F.real)), cmath.phase(F)
    return 0.0, -_leaving(F.real, part.found)
