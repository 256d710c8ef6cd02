"""A rational response behind a delay: its smallest distances, and where its phase first turns by 90 deg."""

from __future__ import annotations

import cmath
import math

import numpy as np
from scipy.optimize import brentq

from actuator_lti.margins.axis_parts import axis_ends, axis_parts, distances_over
from actuator_lti.margins.axis_search import Factored, half_turn, passages
from actuator_lti.margins.distances import Distance
from actuator_lti.margins.factored import Response, factored
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.margins.poles import sorted_poles

_AT_NYQUIST = 1e8  # of the largest root: next to nothing is left of the half circle
_NEAR = 1e-4  # relative: a crossing of the factors and one of the loop


def nearest_behind_delay(
    loop: RationalLoop, delay_s: float, distances: tuple[Distance, ...]
) -> list[tuple[float, float]]:
    """Smallest values of distances, each with its frequency; `Doubtful` where they could not be checked."""
    response, factors = _factors(loop, delay_s)
    with np.errstate(all="ignore"):
        parts, _, _ = axis_parts(factors, None)
        return distances_over(factors, response, parts, axis_ends(factors, response), distances)


def first_turn(loop: RationalLoop, delay_s: float, floor: float) -> float | None:
    """Where the phase first falls to 90 deg below that at zero frequency; ``None``: not above the floor."""
    response, factors = _factors(loop, delay_s)
    with np.errstate(all="ignore"):
        level = half_turn(factors.log_at(0.0)[1]) - 0.5 * math.pi
        if factors.delay:  # no factor turns by more than half a turn
            top = (factors.roots.size + 1.0) * math.pi / factors.delay
        else:
            top = _AT_NYQUIST * max(float(np.abs(factors.roots).max(initial=0.0)), 1.0)
        top = float(passages(factors, 0.0, top, math.log(floor)).min(initial=top))
        turns = passages(factors, 0.0, top, level, 1)
        if not turns.size:
            return None
        sign = cmath.exp(-1j * level)

        def beyond(w: float) -> float:
            return float(np.angle(response.at(np.array([w]))[0] * sign))

        near = float(turns[0])
        w = brentq(beyond, near * (1.0 - _NEAR), near * (1.0 + _NEAR), xtol=1e-300, rtol=1e-14)
        return response.frequency(float(w))


def _factors(loop: RationalLoop, delay_s: float) -> tuple[Response, Factored]:
    response = Response(loop, delay_s / (loop.period_s or 1.0))
    return response, factored(response, sorted_poles(loop.A, loop.in_z))
