"""The axis in the parts in which a factored loop is searched, and how far out it has to be."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from actuator_lti.axis._search import half_turns
from actuator_lti.errors import NumericalError
from actuator_lti.margins.assemble import FARTHEST
from actuator_lti.margins.axis_search import Factored, Found
from actuator_lti.margins.tail import listed, turns
from actuator_lti.margins.trust import TOUCH, Doubtful
from actuator_lti.types import Mask, Real

_LOW, _HIGH = 1e-3, 1e3  # of the smallest and largest root: where the ends of the axis begin
_NEAR_ONE = 1e-6
_HARDLY = 1e-12  # rad
_LEFT = 5.0  # times what the search does not tell from one
_ONE = "the gain is one at an end of the axis"
_FLOORS = (0.01, 0.1, 0.5, 0.9)  # gain: behind a delay margins are listed up to where L stays below
_LEAST_GAIN = 1e-11
_CLEAR = 1e-12  # of the log gain, to either side of a place
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

    With them, up to where crossings of the real axis are listed, and a gain that L does not reach beyond.
    """
    size = np.abs(factors.roots[factors.roots != 0.0])
    scale = 1.0 / factors.delay if factors.delay else 1.0
    least, most = (float(size.min()), float(size.max())) if size.size else (scale, scale)
    low = _start(factors, _LOW * min(least, scale if factors.delay else least))
    if factors.delay:
        found, listed_to, gain = _behind_delay(factors, low, most, band)
        return [Part(factors, found, False)], listed_to, gain
    high, slope = _HIGH * most, factors.at_infinity
    if slope:
        stop = _sided(factors, max(high, 10.0 * high * math.exp(-factors.log_at(high)[0] / slope)), slope)
        return [Part(factors, factors.search(low, stop), False)], math.inf, 0.0
    middle, mirrored = 2.0 * most, factors.reciprocal()
    first = Part(factors, factors.search(low, middle), False)
    last = Part(mirrored, mirrored.search(_start(mirrored, _LOW / most), 1.0 / middle), True)
    return [first, last], math.inf, 0.0


def _behind_delay(
    factors: Factored, low: float, most: float, band: tuple[float, float] | None
) -> tuple[Found, float, float]:
    """The axis up to where |L| is next to nothing, with crossings of the band, or as `listed` has them."""
    slope, high = factors.at_infinity, _HIGH * most
    if slope:
        high = max(high, high * math.exp((math.log(_LEAST_GAIN) - factors.log_at(high)[0]) / slope))
    if band is not None or not slope:
        to = band[1] if band else 10.0 * most + turns(factors.delay)
        return _searched(factors, low, max(high, 10.0 * to), to), to, 0.0

    @cache
    def quiet(gain: float) -> float:
        return float(factors.passages(low, high, math.log(gain) - _CLEAR).max(initial=low))

    def search(to: float) -> tuple[Found, float]:
        found = _searched(factors, low, high, to)
        gain = np.exp(-np.abs(factors.log_value(found.real_w)[0]))
        return found, float(gain[gain * FARTHEST >= 1.0].max(initial=0.0))

    most_turned = 2.0 * math.pi * _MOST_TURNS / factors.delay
    floor = next((f for f in _FLOORS if quiet(f) <= most_turned), _FLOORS[-1])
    return listed(search, quiet, factors.delay, floor, quiet(1.0 / FARTHEST))


def _searched(factors: Factored, low: float, high: float, listed_to: float) -> Found:
    if (count := factors.delay * listed_to / (2.0 * math.pi)) > _MOST_TURNS:
        raise NumericalError(
            f"the delay turns the loop {count:.1e} times where margins are listed; "
            "shorten the delay, or ask for a narrower band_rad_s"
        )
    return factors.search(low, high, listed_to)


def _start(factors: Factored, low: float) -> float:
    """Zero, or a frequency below which gain and phase follow the roots at zero."""
    order = factors.at_zero
    if not order:
        gain, phase = factors.log_at(0.0)
        if factors.one_at_rest and abs(gain) <= TOUCH and math.cos(phase) > 0.0:
            return _off_one(factors, low)
        if abs(gain) < _NEAR_ONE:
            raise Doubtful(_ONE)
        return 0.0
    return _sided(factors, min(low, 0.1 * low * math.exp(-factors.log_at(low)[0] / order)), order)


def _off_one(factors: Factored, end: float) -> float:
    """A frequency at which the gain has left one for good, before the phase meets half a turn: L(0) is 1."""
    while abs(factors.log_at(end)[0]) < 2.0 * _LEFT * factors.slack:
        end *= 2.0
        if not end < 1e150:
            raise Doubtful(_ONE)
    left = math.copysign(_LEFT * factors.slack, factors.log_at(end)[0])
    passed = [factors.passages(0.0, end, level).size for level in (left, -left)]
    phase = factors.along(0.0, end).known[:-1, [4, 6]]
    if passed != [1, 0] or half_turns(phase.min()) != half_turns(phase.max()):
        raise Doubtful(_ONE)
    return end


def _sided(factors: Factored, end: float, slope: float) -> float:
    """An end of the axis at which the side of the real axis on which the loop lies is known."""
    if not 1e-150 < end < 1e150:
        raise Doubtful("too wide a range")
    if slope % 2 == 0 and abs(math.sin(factors.log_at(end)[1])) < _HARDLY:
        raise Doubtful("the phase hardly leaves the real axis at an end of the axis")
    return end
