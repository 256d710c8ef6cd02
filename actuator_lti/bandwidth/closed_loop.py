"""Bandwidths of a closed loop by both definitions, its resonance, and the peaks of S and T."""

from __future__ import annotations

import math
from typing import Any, overload

import flint
import numpy as np
from scipy.optimize import brentq

from actuator_lti.bandwidth.exact_gain import exact_gain
from actuator_lti.bandwidth.measured import measured_bandwidth
from actuator_lti.bandwidth.results import SQUARES, Bandwidth, Level, Peaks
from actuator_lti.errors import InputError
from actuator_lti.margins.delay_distance import delayed_extreme
from actuator_lti.margins.delay_form import DelayForm, Intervals, border_values, delay_form, from_rational
from actuator_lti.margins.delay_setting import low_frequency
from actuator_lti.margins.delayed import delayed_gain_crossings
from actuator_lti.margins.distances import complementary, inverse, modulus
from actuator_lti.margins.exact_extremes import complementary_margin, modulus_margin
from actuator_lti.margins.exact_loop import exact_loop
from actuator_lti.margins.given import Given, given_of
from actuator_lti.margins.loop import Mask, RationalLoop, rational_loop
from actuator_lti.margins.measured_data import is_measured
from actuator_lti.margins.sweep import subdivided, variation
from actuator_lti.systems.exact_fraction import Fraction, dc_noise, double, exact_fraction, shown
from actuator_lti.systems.plain_system import PlainSystem
from actuator_lti.systems.rest_mode import without_rest_mode

_FLOOR = 1e-6  # of the gain at zero frequency: the phase is followed down to it
_TAKEN = flint.fmpq(1, 1000)
_POLE = "the response has a pole at zero frequency: it is no closed loop with a bandwidth"
_NO_GAIN = "DC gain is 0: no -3 dB bandwidth (the response is zero at zero frequency)"


def closed_loop_bandwidth(system: Any, delay_s: float = 0.0, level: Level = "1/sqrt(2)") -> Bandwidth:
    """Bandwidths of a closed-loop response (give T itself, not the open loop).

    Parameters
    ----------
    system : StateSpace, TransferFunction, DelaySystem or FrequencyResponseData
        T, one input, one output; continuous or sampled. Measured data: each figure comes with its range.
    delay_s : float, optional
        Exact delay in series with T, s: it leaves the -3 dB bandwidth and takes phase.
    level : {"1/sqrt(2)", "-3 dB"}
        What "-3 dB" is: 1/sqrt(2) of the value at zero frequency (default), or 10^(-3/20) of it.

    Raises
    ------
    InputError
        T is zero or infinite at zero frequency: there is nothing to measure the fall from.

    Examples
    --------
    >>> import control
    >>> print(closed_loop_bandwidth(control.tf([1], [1, 1])))
    bandwidth: 0.159155 Hz (1/sqrt(2)), none (-90 deg); resonance +0.0000 dB at 0 Hz
    """
    if level not in SQUARES:
        raise InputError(f"level = {level!r}: one of {list(SQUARES)}")
    if is_measured(system):
        return measured_bandwidth(system, delay_s, level)
    if hasattr(system, "delays_s"):
        if system.delays_s.size:
            return _of_delays(system, delay_s, level)
        system = system.to_state_space()
    system = _without_rest_mode(system)
    loop = rational_loop(system)
    fraction = exact_fraction(system)
    seen = shown(fraction, loop)
    gain = exact_gain(seen, loop.in_z)
    if gain is None:
        raise InputError(_POLE)
    if seen is not fraction and _taken(fraction, gain.dc, 1 if loop.in_z else 0):
        raise InputError(_NO_GAIN)
    if abs(double(gain.dc)) <= dc_noise(loop):
        raise InputError(_NO_GAIN)
    peak, place = gain.largest()
    turn = _unwarped(gain.first_turn(_FLOOR**2), loop)
    if delay_s:
        turn = _first_turn(from_rational(loop, delay_s), double(gain.dc))
        turn = None if turn is None else loop.frequency(turn) if loop.in_z else turn
    crossings = [_unwarped(w, loop) for w in gain.crossings(SQUARES[level])]
    return _bandwidth(crossings, turn, 20.0 * math.log10(peak) if peak < math.inf else peak,
                      _unwarped(place, loop), double(gain.dc), level)  # fmt: skip


def _taken(fraction: Fraction, dc: flint.fmpq, at: int) -> bool:
    """Whether a mode seen at zero frequency alone takes the gain away there: a spring, however weak."""
    below = fraction.den(at)
    return bool(below != 0 and abs(fraction.num(at) / below) < _TAKEN * abs(dc))


def _without_rest_mode(system: Any) -> Any:
    """A state space without a mode at zero frequency that it does not show."""
    if not hasattr(system, "A") or system.ninputs != 1 or system.noutputs != 1:
        return system
    in_z = system.dt is not None and system.dt != 0
    A, B, C, kept = without_rest_mode(system.A, system.B, system.C, 1.0 if in_z else 0.0)
    return system if kept.all() else PlainSystem(A, B, C, system.D, system.dt)


def _bandwidth(
    crossings: list[float], turn: float | None, resonance_db: float, place: float, dc: float, level: Level
) -> Bandwidth:
    return Bandwidth(
        minus3db_rad_s=crossings[0] if crossings else None,
        minus90deg_rad_s=turn,
        resonance_peak_db=resonance_db if resonance_db > 1e-9 else 0.0,
        resonance_rad_s=place if resonance_db > 1e-9 else 0.0,
        dc_gain=dc,
        definition=level,
        crossings_rad_s=tuple(crossings),
    )


@overload
def _unwarped(w: float, loop: RationalLoop | Given) -> float: ...
@overload
def _unwarped(w: float | None, loop: RationalLoop | Given) -> float | None: ...
def _unwarped(w: float | None, loop: RationalLoop | Given) -> float | None:
    """From the s-plane of an exact sampled system to rad/s."""
    if w is None or loop.period_s is None:
        return w
    return 2.0 * math.atan(w) / loop.period_s


def _of_delays(system: Any, delay_s: float, level: Level) -> Bandwidth:
    form = delay_form(system, delay_s)
    dc = _dc(form)
    falls = delayed_gain_crossings(form.without_series(), abs(dc) * math.sqrt(SQUARES[level]))
    least, place = delayed_extreme(form.without_series(), inverse)
    peak_db = -20.0 * math.log10(least * abs(dc)) if least > 0.0 else math.inf
    return _bandwidth(list(falls), _first_turn(form, dc), peak_db, place, dc, level)


def peaks(system: Any, delay_s: float = 0.0) -> Peaks:
    """Peaks of S and T of the loop ``system`` (the open loop L) under negative unit feedback.

    Parameters
    ----------
    system : StateSpace, TransferFunction or DelaySystem
        L, one input, one output.
    delay_s : float, optional
        Exact delay in series with L, s.
    """
    if is_measured(system):
        raise InputError(
            "measured data: the peak of S is 1 over stability_margins(L).modulus_margin, in its range"
        )
    inner = hasattr(system, "delays_s") and system.delays_s.size > 0
    if inner or delay_s:
        form = (
            delay_form(system, delay_s)
            if hasattr(system, "delays_s")
            else from_rational(rational_loop(system), delay_s)
        )
        result = [delayed_extreme(form, distance) for distance in (modulus, complementary)]
        unit = 1.0 if form.period_s is None else 1.0 / form.period_s
    else:
        given = given_of(system.to_state_space() if hasattr(system, "delays_s") else system)
        loop = exact_loop(given)
        result = [
            (value, _unwarped(w, given)) for value, w in (modulus_margin(loop), complementary_margin(loop))
        ]
        unit = 1.0
    (s_value, s_place), (t_value, t_place) = result
    return Peaks(_db(s_value), s_place * unit, _db(t_value), t_place * unit)


def _db(inverse: float) -> float:
    return 0.0 - 20.0 * math.log10(inverse) if inverse > 0.0 else math.inf


def _dc(form: DelayForm) -> float:
    low, order = low_frequency(form)
    if order:
        raise InputError(_POLE)
    value = _value_at_rest(form.without_series(), low)
    reference = float(np.abs(border_values(form.without_series(), np.array([low * 1e3])))[0])
    if abs(value) <= 1e-12 * reference:
        raise InputError(_NO_GAIN)
    return value


def _value_at_rest(form: DelayForm, low: float) -> float:
    """L(0), exact where a mode at rest that L does not show leaves 0/0; at ``low`` where none is."""
    if not form.sampled and form.delays.size:
        from actuator_lti.margins.exact_delay import singular_at_rest, value_at_rest  # flint if needed

        if singular_at_rest(form) and (exact := value_at_rest(form)) is not None:
            return exact
    try:
        value = float(border_values(form, np.zeros(1))[0].real)
    except np.linalg.LinAlgError:
        value = math.nan
    return value if math.isfinite(value) else float(border_values(form, np.array([low]))[0].real)


def _first_turn(form: DelayForm, dc: float) -> float | None:
    """First x at which the phase, followed from zero frequency, falls below -90 deg.

    The phase is followed as long as the gain is above 1e-6 of its value at zero frequency.
    """
    low, _ = low_frequency(form)
    high = math.pi if form.sampled else low * 10.0
    floor = _FLOOR * abs(dc)

    def resolved(intervals: Intervals) -> Mask:
        size, R = np.abs(intervals.L), variation(form, intervals)
        return (0.3 * size > R) | (size + R < floor)

    x0, L0 = low, complex(border_values(form, np.array([low]))[0]) * float(np.sign(dc))
    phase0 = float(np.angle(L0))
    for _ in range(1 if form.sampled else 20):
        intervals = subdivided(form, np.geomspace(x0, high, 12), resolved)
        L = np.concatenate(([L0], intervals.L * np.sign(dc)))
        x = np.concatenate(([x0], intervals.x))
        phase = phase0 + np.concatenate(([0.0], np.cumsum(np.angle(L[1:] * L[:-1].conj()))))
        low_gain = np.abs(L) < floor
        below = np.flatnonzero((phase < -0.5 * np.pi) & ~np.maximum.accumulate(low_gain))
        if below.size and below[0] > 0:
            k = int(below[0])
            return _turn_between(
                form, (float(x[k - 1]), float(x[k])), complex(L[k - 1]), float(phase[k - 1]), dc
            )
        if low_gain.any():
            return None
        x0, L0, phase0 = float(x[-1]), complex(L[-1]), float(phase[-1])
        high *= 10.0
    return None


def _turn_between(
    form: DelayForm, bracket: tuple[float, float], L_before: complex, phase_before: float, dc: float
) -> float:
    def excess(x: float) -> float:
        L = complex(border_values(form, np.array([x]))[0]) * float(np.sign(dc))
        return phase_before + float(np.angle(L * L_before.conjugate())) + 0.5 * np.pi

    return float(brentq(excess, *bracket, xtol=1e-300, rtol=1e-14))
