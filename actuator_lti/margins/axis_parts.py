"""The axis in the parts in which a factored loop is searched: ends, crossings, smallest distances, turns."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from actuator_lti.errors import NumericalError
from actuator_lti.margins.axis_search import Factored, Found, nearest, passages, search
from actuator_lti.margins.distances import Distance
from actuator_lti.margins.factored import SAME, Response
from actuator_lti.margins.loop import Complex, Mask, Real
from actuator_lti.margins.trust import Doubtful

_LOW, _HIGH = 1e-3, 1e3  # of the smallest and largest root: where the ends of the axis begin
_NEAR_ONE = 1e-6
_HARDLY = 1e-12  # rad
_FLOORS = (0.01, 0.1, 0.5, 0.9)  # gain below which, behind a delay, no crossing of the real axis is listed
_LEAST_GAIN = 1e-8
_MOST_TURNS = 100_000  # of the delay that are listed, about a second's work


@dataclass(frozen=True)
class Part:
    """A part of the axis: up to the middle, or from there on as 1/w."""

    factors: Factored
    found: Found
    beyond: bool

    @property
    def in_w(self) -> tuple[Real, Real, Mask]:
        """Its crossings in order of w, and which way they go."""
        gain, real, rising = self.found.gain_w, self.found.real_w, self.found.rising
        if not self.beyond:
            return gain, real, rising
        return np.divide(1.0, gain[::-1]), np.divide(1.0, real[::-1]), rising[::-1]


def axis_parts(factors: Factored, band: tuple[float, float] | None) -> tuple[list[Part], float, float]:
    """The axis in one part where the gain falls off or turns for ever, else in two: infinity is zero of 1/w.

    With them, up to where crossings of the real axis are listed, and above which gain.
    """
    size = np.abs(factors.roots[factors.roots != 0.0])
    scale = 1.0 / factors.delay if factors.delay else 1.0
    least, most = (float(size.min()), float(size.max())) if size.size else (scale, scale)
    low = _start(factors, _LOW * min(least, scale if factors.delay else least))
    if factors.delay:
        most_turned = 2.0 * math.pi * _MOST_TURNS / factors.delay
        high, listed_to, floor = _turning_stop(factors, low, most, most_turned)
        if band is not None:
            listed_to, high = float(band[1]), max(high, 2.0 * float(band[1]))
        if listed_to > most_turned:
            turns = factors.delay * listed_to / (2.0 * math.pi)
            raise NumericalError(
                f"the delay turns the loop {turns:.1e} times where margins are listed; "
                "shorten the delay, or ask for a narrower band_rad_s"
            )
        return [Part(factors, search(factors, low, high, listed_to), False)], listed_to, floor
    if factors.at_infinity:
        return [Part(factors, search(factors, low, _stop(factors, _HIGH * most)), False)], math.inf, 0.0
    middle, mirrored = 2.0 * most, factors.reciprocal()
    return (
        [
            Part(factors, search(factors, low, middle), False),
            Part(mirrored, search(mirrored, _start(mirrored, _LOW / most), 1.0 / middle), True),
        ],
        math.inf,
        0.0,
    )


def _turning_stop(
    factors: Factored, low: float, most: float, most_turned: float
) -> tuple[float, float, float]:
    """Under a delay: a frequency above which |L| is next to nothing, and up to where crossings are listed.

    With them the gain above which they are: the lowest of `_FLOORS` that does not list too many turns.
    """
    slope, high = factors.at_infinity, _HIGH * most
    if not slope:
        listed_to = 10.0 * most + 8.0 * math.pi / factors.delay
        return 10.0 * max(high, listed_to), listed_to, 0.0
    top = max(high, high * math.exp((math.log(_LEAST_GAIN) - factors.log_at(high)[0]) / slope))
    for floor in _FLOORS:
        listed_to = float(passages(factors, low, top, math.log(floor)).max(initial=low))
        if listed_to <= most_turned:
            break
    return top, listed_to, floor


def _stop(factors: Factored, high: float) -> float:
    """A frequency above which gain and phase follow the slope at infinity."""
    slope = factors.at_infinity
    return _told(factors, max(high, 10.0 * high * math.exp(-factors.log_at(high)[0] / slope)), slope)


def _start(factors: Factored, low: float) -> float:
    """Zero, or a frequency below which gain and phase follow the roots at zero."""
    order = factors.at_zero
    if not order:
        if abs(factors.log_at(0.0)[0]) < _NEAR_ONE:
            raise Doubtful("the gain is one at an end of the axis")
        return 0.0
    return _told(factors, min(low, 0.1 * low * math.exp(-factors.log_at(low)[0] / order)), order)


def _told(factors: Factored, end: float, slope: float) -> float:
    """An end of the axis at which the side of the real axis on which the loop lies is known."""
    if not 1e-150 < end < 1e150:
        raise Doubtful("too wide a range")
    if slope % 2 == 0 and abs(math.sin(factors.log_at(end)[1])) < _HARDLY:
        raise Doubtful("the phase hardly leaves the real axis at an end of the axis")
    return end


def axis_ends(factors: Factored, response: Response) -> tuple[complex, complex]:
    """L at both ends of the axis: infinity where it has a pole, exactly 0 where it has a zero."""
    first = response.at_rest() if not factors.at_zero else complex(math.inf if factors.at_zero < 0.0 else 0.0)
    return first, response.at_end()


def merged(parts: list[Part]) -> tuple[Real, Real, Mask, int]:
    """All crossings in order of w."""
    gain, real, rising = map(np.concatenate, zip(*(part.in_w for part in parts), strict=True))
    return gain, real, rising, sum(part.found.far for part in parts)


def distances_over(
    factors: Factored,
    response: Response,
    parts: list[Part],
    ends: tuple[complex, complex],
    distances: tuple[Distance, ...],
) -> list[tuple[float, float]]:
    """Smallest values of distances, each with its frequency."""
    nearest_ends = (ends[0], complex(-abs(ends[1])) if factors.delay else ends[1])
    best = [
        min((d.at(value), w) for value, w in zip(nearest_ends, (0.0, math.inf), strict=True))
        for d in distances
    ]
    for part in parts:
        found = nearest(part.factors, part.found, distances, best)
        best = [
            (new[0], 1.0 / new[1] if part.beyond else new[1]) if new[0] < old[0] else old
            for new, old in zip(found, best, strict=True)
        ]
    inside = [w for _, w in best if 0.0 < w < math.inf]
    L = dict(zip(inside, response.at(np.array(inside)).tolist(), strict=True)) if inside else {}
    return [
        (d.at(L[w]) if w in L else value, response.frequency(w))
        for d, (value, w) in zip(distances, best, strict=True)
    ]


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
    gain, phase = factors.log_at(low)
    if not abs(on_axis * cmath.exp(complex(-gain, -phase)) - 1.0) <= SAME:  # integrators that cancel
        raise Doubtful("poles and zeros in double precision do not make up the loop next to zero frequency")
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
