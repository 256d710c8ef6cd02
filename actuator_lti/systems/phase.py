"""Phase without ambiguity: unwrapped factor by factor, the same on any grid."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from actuator_lti.errors import InputError, delay_number
from actuator_lti.margins.axis_search import Factored, half_turn
from actuator_lti.margins.delays.form import delay_form
from actuator_lti.margins.exact.loop import exact_loop
from actuator_lti.margins.factored import factored
from actuator_lti.margins.given import Given, given_of
from actuator_lti.margins.loop import RationalLoop, loop_of
from actuator_lti.margins.measured.margins import measured_points
from actuator_lti.margins.trust import Doubtful
from actuator_lti.measured.bounds import bounds
from actuator_lti.measured.response import is_measured, measured_response
from actuator_lti.systems.delay_response import DelayResponse, plain_behind_delay
from actuator_lti.types import Delay, Real, number_array

_AT_REST = 1e-10  # of the median: a root this near to zero is one at zero, beside which the side is rounding
_ON_AXIS = 1e-30  # relative: what certified roots leave of an undamped one


def unwrapped_phase_deg(system: Any, omega_rad_s: ArrayLike, delay_s: Delay = 0.0) -> Real:
    """Phase of a system over frequency, in deg, without jumps of 360 deg whatever the grid.

    The phase of a rational system is the sum of the phases of its poles and zeros, that of a delay is
    -omega delay; that of a system with inner delays is counted from where it meets the negative real axis. At
    zero frequency the phase is -90 deg for each integrator (1/s^3 starts at -270), and 180 deg less for a
    negative gain; a root within rounding of zero counts as one there. An undamped resonance turns by
    -180 deg, as a damped one does.

    ``system``: StateSpace, TransferFunction (of scipy.signal too), DelaySystem or FrequencyResponseData of
    one input and one output, continuous or sampled. Measured data have no factors: their phase is followed
    from point to point, from between -180 and 180 deg at the first, straight over log frequency.
    ``omega_rad_s``: angular frequencies > 0 (for a sampled system up to the Nyquist frequency, for measured
    data within their band), any order, any shape, which is that of the result.
    ``delay_s``: exact delay in series, s.

    Raises `InputError`: a frequency that is not positive and finite, or beyond Nyquist; measured data:
    outside of their band, or behind an interval in which the phase turns as no smooth curve does, or is lost
    in noise.

    Examples
    --------
    >>> import control
    >>> lag = control.tf([1], [0.01, 1])
    >>> round(float(unwrapped_phase_deg(lag, 1e4, delay_s=0.02)), 1)
    -11548.6
    """
    delay_s = delay_number(delay_s)
    try:
        omega = number_array(omega_rad_s)
    except (TypeError, ValueError):
        omega = np.array(np.nan)
    if not (np.isfinite(omega).all() and (omega > 0.0).all()):
        raise InputError("omega_rad_s: every frequency must be positive and finite")
    flat = np.atleast_1d(omega).ravel()
    if is_measured(system):
        return np.degrees(_measured_phase(system, flat, delay_s)).reshape(omega.shape)
    if hasattr(system, "delays_s"):
        if (plain := plain_behind_delay(system, delay_s)) is None:
            phase = DelayResponse.of(delay_form(system)).phase(flat)
            return np.degrees(phase - flat * delay_s).reshape(omega.shape)
        system, delay_s = plain
    given = given_of(system)
    period = given.period_s
    if period is not None and (flat * period > math.pi * (1.0 + 1e-12)).any():
        raise InputError(f"omega_rad_s: up to the Nyquist frequency {math.pi / period:.6g} rad/s")
    w = flat if period is None else np.tan(np.minimum(0.5 * flat * period, 0.5 * math.pi))
    return np.degrees(_rational_phase(given, w) - flat * delay_s).reshape(omega.shape)


def _measured_phase(data: Any, omega: Real, delay_s: float) -> Real:
    """Phase of measured data in rad, between their points."""
    at, L, radius = measured_points(measured_response(data), None)
    result = bounds(at, L, radius, delay_s)
    low, high = at[0] * (1.0 - 1e-12), at[-1] * (1.0 + 1e-12)
    known, what = high, "outside of the measured band"
    if (open_from := np.flatnonzero(result.unresolved | result.lost[1:])).size:
        known = at[open_from[0]] * (1.0 + 1e-12)
        what = f"the points do not tell how the phase turns beyond {known:.6g} rad/s"
    if (omega < low).any() or (omega > known).any():
        asked = omega[(omega < low) | (omega > known)][0]
        what = what if low <= asked <= high else "outside of the measured band"
        raise InputError(f"omega_rad_s: {asked:.6g} rad/s: {what}; allowed: {low:.6g} to {known:.6g} rad/s")
    return np.interp(np.log(omega), np.log(at), result.phase.middle)


def _rational_phase(given: Given, w: Real) -> Real:
    """Of a rational loop, rad, over w of the s-plane."""
    loop = loop_of(given, warp=True)
    try:
        factors = factored(loop)
    except Doubtful:  # from the roots of the exact polynomials, but for their constant
        exact = exact_loop(given)
        above, below = (np.array(part.values, dtype=complex) for part in (exact.zeros, exact.poles))
        roots, weights = np.append(above, below), np.append(np.ones(above.size), -np.ones(below.size))
        roots.real[np.abs(roots.real) < _ON_AXIS * np.abs(roots.imag)] = 0.0
        factors = Factored(roots, weights, 0.0)
    size = np.abs(factors.roots)
    at_rest = size <= _AT_REST * np.median(size) if size.size else size > 0.0
    first = 1e-3 * float(size[~at_rest].min(initial=1.0))
    phase = factors.log_value(np.append(w, first))[1] + _sign(loop, factors)
    phase, start = phase[:-1], phase[-1]
    half_turns = round(float(start / np.pi - 0.5 * factors.weights[at_rest].sum()))  # odd: a negative gain
    phase -= np.pi * (half_turns + half_turns % 2)
    correction = np.angle(loop.at(w) * np.exp(-1j * phase))  # of the last digits; more is rounding, or a pole
    return phase + np.where(np.abs(correction) < 0.5 * np.pi, correction, 0.0)


def _sign(loop: RationalLoop, factors: Factored) -> float:
    """The half turns by which the factors' phase is off, told where the loop is known best: nearest to 1."""
    size = np.abs(factors.roots)
    w = 1.01 * (size[size > 0.0] if size.any() else np.ones(1))
    L = loop.at(w)
    with np.errstate(divide="ignore", invalid="ignore"):
        k = int(np.nan_to_num(np.abs(np.log(np.abs(L))), nan=np.inf).argmin())
    return half_turn(float(np.angle(L[k]) - factors.log_value(w[k : k + 1])[1][0]))
