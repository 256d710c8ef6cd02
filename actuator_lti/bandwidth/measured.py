"""Bandwidths of a measured closed loop: each with the range in which it lies."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from actuator_lti.bandwidth.results import SQUARES, Bandwidth, Level, Range
from actuator_lti.errors import InputError
from actuator_lti.margins.measured import margins
from actuator_lti.margins.single import frequency_text
from actuator_lti.measured.bounds import Bounds, Strip, bounds
from actuator_lti.measured.response import MeasuredResponse, at_once, measured_response
from actuator_lti.types import Complex, Real


@dataclass(frozen=True)
class _Rest:
    """ln |T| at zero frequency, how far it may lie below and above that, its sign, and how it is known."""

    log_gain: float
    down: float
    up: float
    sign: float
    note: str


def measured_bandwidth(data: Any, delay_s: float, level: Level) -> Bandwidth:
    """Bandwidths from `control.FrequencyResponseData` or `MeasuredResponse` of a closed loop T.

    T at zero frequency is the point measured there; without one the lowest point, which may lie off it by as
    much as the gain changes over the first octave (a third of that for the first term in w^2).

    Raises `InputError`: data as `stability_margins` refuses them, or a phase at the lowest point that leaves
    the sign open.
    """
    response = measured_response(data)
    omega, T, radius = margins.measured_points(response, None)
    result = bounds(omega, T, radius, delay_s)
    margins.refuse_coarse(omega, T, result)
    rest = _at_rest(response, omega, T, result)
    gain = _relative(result.log_gain, rest)
    falls, fall_range = _falls(omega, gain, 0.5 * math.log(SQUARES[level]))
    start = 0.0 if rest.sign > 0.0 else math.copysign(math.pi, float(np.angle(T[0])))
    turns, turn_range = _falls(omega, result.phase, start - 0.5 * math.pi)
    k = int(gain.middle.argmax())
    peak = max(float(gain.middle[k]), 0.0)
    largest = float(np.log(np.maximum(np.abs(T) - at_once(radius), 1e-300)).max()) - rest.log_gain - rest.up
    coarse = [f"{result.too_coarse(omega)}: the gain there is not known"] if result.unresolved.any() else []
    found = Bandwidth(
        minus3db_rad_s=falls[0] if falls else None,
        minus90deg_rad_s=turns[0] if turns else None,
        resonance_peak_db=_db(peak),
        resonance_rad_s=float(omega[k]) if peak else 0.0,
        dc_gain=rest.sign * math.exp(rest.log_gain),
        definition=level,
        crossings_rad_s=falls,
        minus3db_range_rad_s=fall_range,
        minus90deg_range_rad_s=turn_range,
        resonance_range_db=(_db(max(largest, 0.0)), _db(max(float(gain.high.max()), 0.0))),
        notes=(rest.note, *coarse, f"noise: {response.source or 'none'}"),
    )
    if response.noise_known:
        return found
    return replace(found, minus3db_range_rad_s=None, minus90deg_range_rad_s=None, resonance_range_db=None)


def _at_rest(response: MeasuredResponse, omega: Real, T: Complex, result: Bounds) -> _Rest:
    down, up = float(result.log_gain.down[0]), float(result.log_gain.up[0])
    zero = np.flatnonzero(response.omega == 0.0)
    if zero.size:
        value = float(response.frdata[zero[0]].real)
        if not abs(value) > 0.0:
            raise InputError("DC gain is 0: no -3 dB bandwidth")
        return _Rest(math.log(abs(value)), down, up, math.copysign(1.0, value), "T(0) is measured")
    off = abs(math.remainder(float(np.angle(T[0])), math.pi)) + float(result.phase.up[0])
    if off > 0.25 * math.pi:
        raise InputError(
            f"measured data: at the lowest point, {frequency_text(omega[0])}, the phase of T is "
            f"{np.degrees(np.angle(T[0])):.1f} deg; T at zero frequency is not known: measure lower"
        )
    middle = result.log_gain.middle
    octave = min(int(np.searchsorted(omega, 2.0 * omega[0])), omega.size - 1)
    bend = abs(float(middle[octave] - middle[0]))
    note = (
        f"T(0) is taken from the lowest point, {frequency_text(omega[0])}, to "
        f"{_db(-down - bend):+.3f} and {_db(up + bend):+.3f} dB"
    )
    return _Rest(float(middle[0]), down + bend, up + bend, math.copysign(1.0, T[0].real), note)


def _relative(strip: Strip, rest: _Rest) -> Strip:
    """The gain over that at zero frequency, wider by what is not known of it."""
    return replace(
        strip,
        middle=strip.middle - rest.log_gain,
        down=strip.down + rest.up,
        up=strip.up + rest.down,
        low=strip.low - rest.log_gain - rest.up,
        high=strip.high - rest.log_gain + rest.down,
    )


def _falls(omega: Real, strip: Strip, level: float) -> tuple[tuple[float, ...], Range | None]:
    """Where a level is passed for sure, and the range of the first: from where on it may have been."""
    groups = margins.single_passages(strip, level)
    sure = [(group, at) for group in groups if (at := margins.passed(strip, level, group)) is not None]
    if not sure:
        return (), None
    first, last = groups[0], sure[0][0]
    low = margins.between(omega, first.first, float(first.t0[0]))
    high = margins.between(omega, last.last, float(last.t1[-1]))
    return tuple(margins.between(omega, k, t) for _, (k, t) in sure), (low, high)


def _db(log_gain: float) -> float:
    return 20.0 / math.log(10.0) * log_gain
