"""Bandwidths of a closed loop by both definitions, its resonance, and the peaks of S and T."""

import cmath
import math
from dataclasses import replace
from typing import Any

import flint
import numpy as np

from actuator_lti.bandwidth.measured import measured_bandwidth
from actuator_lti.bandwidth.rational_response import RationalResponse
from actuator_lti.bandwidth.results import SQUARES, Bandwidth, Level, Peaks
from actuator_lti.errors import InputError, delay_number
from actuator_lti.margins.axis_search import half_turn
from actuator_lti.margins.delays.form import DelayForm, delay_form, in_series
from actuator_lti.margins.distances import COMPLEMENTARY, INVERSE, MODULUS, Place
from actuator_lti.margins.exact.crossings import smallest
from actuator_lti.margins.exact.loop import exact_loop, exact_polynomials
from actuator_lti.margins.exact.product import late_distances
from actuator_lti.margins.factored import factored
from actuator_lti.margins.given import Given, given_of, of_scipy, unwarped, whole_samples
from actuator_lti.margins.loop import RationalLoop, loop_of, rational_loop
from actuator_lti.margins.trust import Doubtful
from actuator_lti.measured.response import is_measured
from actuator_lti.systems.delay_response import DelayResponse, plain_behind_delay
from actuator_lti.systems.exact_response import dc_noise, shown
from actuator_lti.systems.plain_system import PlainSystem
from actuator_lti.systems.precision import precision
from actuator_lti.systems.rest_mode import without_rest_mode
from actuator_lti.systems.root import root
from actuator_lti.types import Delay

_FLOOR = 1e-6  # of the gain at zero frequency: the phase is followed down to it
_TAKEN = flint.fmpq(1, 1000)
_AT_NYQUIST = 1e8  # of the largest root: next to nothing is left of the half circle
_NEAR = 1e-4  # relative: a crossing of the factors and one of the loop
_PEAKS = MODULUS, COMPLEMENTARY
_POLE = "the response has a pole at zero frequency: it is no closed loop with a bandwidth"
_NO_GAIN = "DC gain is 0: no -3 dB bandwidth (the response is zero at zero frequency)"


@precision()
def closed_loop_bandwidth(system: Any, delay_s: Delay = 0.0, level: Level = "1/sqrt(2)") -> Bandwidth:
    """Bandwidths of a closed-loop response (give T itself, not the open loop).

    One input, one output; continuous, sampled or a `DelaySystem`. Of measured data each figure comes with
    its range. ``delay_s``: exact delay in series with T: it leaves the -3 dB bandwidth and takes phase.
    ``level``: "-3 dB" is 1/sqrt(2) of the value at zero frequency, or 10^(-3/20) of it.

    Raises `InputError`: T is zero or infinite at zero frequency: there is nothing to measure the fall from. A
    direct feed-through with a delay that is no plain shift of T: one in a loop or beside another path.

    Examples
    --------
    >>> import control
    >>> print(closed_loop_bandwidth(control.tf([1], [1, 1])))
    bandwidth: 0.159155 Hz (1/sqrt(2)), none (-90 deg); resonance +0.0000 dB at 0 Hz
    """
    delay_s = delay_number(delay_s)
    if is_measured(system):
        return measured_bandwidth(system, delay_s, level)
    if hasattr(system, "delays_s"):
        if (plain := plain_behind_delay(system, delay_s)) is None:
            found = DelayResponse.of(delay_form(system, delay_s))
            if found.order:
                raise InputError(_POLE if found.order > 0 else _NO_GAIN)
            return _bandwidth(found, found.first_turn(_FLOOR * abs(found.lead)), level, None)
        system, delay_s = plain
    system = _without_rest_mode(of_scipy(system))
    loop, given = rational_loop(system), given_of(system)
    exact = exact_loop(given)
    seen = shown(exact, loop)
    if seen.D[0] == 0:
        raise InputError(_POLE)
    response = RationalResponse(seen.N, seen.D)
    if seen is not exact:
        if exact.D[0] != 0 and abs(flint.fmpq(exact.N[0], exact.D[0])) < _TAKEN * abs(response.dc):
            raise InputError(_NO_GAIN)  # a mode seen at zero frequency alone takes the gain: a spring
        if _is_resolved(given, response.dc):
            response = RationalResponse(exact.N, exact.D)
    if abs(response.lead) <= dc_noise(loop):
        raise InputError(_NO_GAIN)
    floor = _FLOOR * abs(response.lead)
    late = loop_of(given, warp=True) if delay_s else None
    turn = first_turn(late, delay_s, floor) if late else response.first_turn(floor)
    return _bandwidth(response, turn, level, loop.period_s)


def _is_resolved(given: Given, dc: flint.fmpq) -> bool:
    """Whether 8 ulp of the entries leave the gain at zero frequency what it is, apart from that given."""
    values, at = [], 0 if given.period_s is None else 1
    for num, den in map(exact_polynomials, (given, *given.neighbours())):
        if den(at) == 0:
            return False
        values.append(flint.fmpq(num(at), den(at)))
    return all(abs(value - values[0]) < abs(values[0] - dc) / 100 for value in values[1:])


def _without_rest_mode(system: Any) -> Any:
    """A state space without a mode at zero frequency that it does not show."""
    if not hasattr(system, "A") or system.ninputs != 1 or system.noutputs != 1:
        return system
    in_z = system.dt is not None and system.dt != 0
    A, B, C, kept = without_rest_mode(system.A, system.B, system.C, 1.0 if in_z else 0.0)
    return system if kept.all() else PlainSystem(A, B, C, system.D, system.dt)


def _bandwidth(
    response: RationalResponse | DelayResponse, turn_w: float | None, level: Level, period_s: float | None
) -> Bandwidth:
    dc = abs(response.lead)
    crossings = [unwarped(w, period_s) for w in response.crossings(dc * math.sqrt(SQUARES[level]))]
    least, place = response.smallest(INVERSE)
    peak_db = _db(least * dc)
    return Bandwidth(
        minus3db_rad_s=crossings[0] if crossings else None,
        minus90deg_rad_s=None if turn_w is None else unwarped(turn_w, period_s),
        resonance_peak_db=peak_db if peak_db > 1e-9 else 0.0,
        resonance_rad_s=unwarped(place, period_s) if peak_db > 1e-9 else 0.0,
        dc_gain=response.lead,
        definition=level,
        crossings_rad_s=tuple(crossings),
    )


@precision()
def peaks(system: Any, delay_s: Delay = 0.0) -> Peaks:
    """Peaks of S and T of the open loop L, one input, one output, under negative unit feedback.

    ``delay_s``: exact delay in series with L.
    """
    delay_s = delay_number(delay_s)
    if is_measured(system):
        raise InputError(
            "measured data: the peak of S is 1 over stability_margins(L).modulus_margin, in its range"
        )
    if hasattr(system, "delays_s"):
        if (plain := plain_behind_delay(system, delay_s)) is None:
            return _peaks(_inside_delays(delay_form(system, delay_s)), None)
        system, delay_s = plain
    given = given_of(system)
    period_s = given.period_s
    whole = whole_samples(delay_s / period_s) if period_s else None if delay_s else 0
    if whole is None:
        return _peaks(_behind_delay(given, delay_s), period_s)
    loop = exact_loop(replace(given, samples=whole))
    return _peaks([smallest(loop.N, loop.D, distance) for distance in _PEAKS], period_s)


def _behind_delay(given: Given, delay_s: float) -> list[Place]:
    """By certified zeros and poles; where these leave a doubt of a continuous loop by certified intervals."""
    try:
        return late_distances(given, delay_s, _PEAKS)
    except Doubtful:
        if given.period_s is not None:
            raise
        return _inside_delays(in_series(loop_of(given), delay_s))


def _inside_delays(form: DelayForm) -> list[Place]:
    response = DelayResponse.of(form)
    return [response.smallest(distance) for distance in _PEAKS]


def _peaks(places: list[Place], period_s: float | None) -> Peaks:
    (s_value, s_w), (t_value, t_w) = places
    return Peaks(_db(s_value), unwarped(s_w, period_s), _db(t_value), unwarped(t_w, period_s))


def _db(inverse: float) -> float:
    return 0.0 - 20.0 * math.log10(inverse) if inverse > 0.0 else math.inf


def first_turn(loop: RationalLoop, delay_s: float, floor: float) -> float | None:
    """The w at which the phase first falls to 90 deg below that at rest; ``None``: not above the floor."""
    late = loop.behind(delay_s)
    factors = factored(late)
    with np.errstate(all="ignore"):
        level = half_turn(factors.log_at(0.0)[1]) - 0.5 * math.pi
        if factors.delay:  # no factor turns by more than half a turn
            top = (factors.roots.size + 1.0) * math.pi / factors.delay
        else:
            top = _AT_NYQUIST * max(float(np.abs(factors.roots).max(initial=0.0)), 1.0)
        top = float(factors.passages(0.0, top, math.log(floor)).min(initial=top))
        turns = factors.passages(0.0, top, level, 1)
        if not turns.size:
            return None
        sign = cmath.exp(-1j * level)

        def beyond(w: float) -> float:
            return float(np.angle(late.at(np.array([w]))[0] * sign))

        near = float(turns[0])
        return root(beyond, near * (1.0 - _NEAR), near * (1.0 + _NEAR))
