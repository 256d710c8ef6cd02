"""Phase without ambiguity: unwrapped factor by factor, the same on any grid."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from actuator_lti.errors import InputError
from actuator_lti.margins.delay_form import delay_form
from actuator_lti.margins.delay_response import DelayResponse
from actuator_lti.margins.factors import factor_phase, poles, zeros
from actuator_lti.margins.loop import RationalLoop, Real, rational_loop
from actuator_lti.margins.measured import measured_points
from actuator_lti.margins.measured_bounds import bounds
from actuator_lti.margins.measured_data import is_measured, measured_response
from actuator_lti.margins.poles import sorted_poles


def unwrapped_phase_deg(system: Any, omega_rad_s: ArrayLike, delay_s: float = 0.0) -> Real:
    """Phase of a system over frequency, in deg, without jumps of 360 deg whatever the grid.

    The phase of a rational system is the sum of the phases of its poles and zeros, that of a delay is
    -omega delay; that of a system with inner delays is counted from where it meets the negative real axis. At
    zero frequency the phase is -90 deg for each integrator (1/s^3 starts at -270),
    and 180 deg less for a negative gain. An undamped resonance turns by -180 deg, as a damped one does.

    Parameters
    ----------
    system : StateSpace, TransferFunction, DelaySystem or FrequencyResponseData
        One input, one output, continuous or sampled. Measured data have no factors: their phase is followed
        from point to point, from between -180 and 180 deg at the first, straight over log frequency.
    omega_rad_s : array_like
        Angular frequencies > 0 (for a sampled system up to the Nyquist frequency, for measured data within
        their band), any order, any shape.
    delay_s : float, optional
        Exact delay in series, s.

    Returns
    -------
    array
        Phase in deg, shape of ``omega_rad_s``.

    Raises
    ------
    InputError
        A frequency that is not positive and finite, or beyond Nyquist; measured data: outside of their band,
        or behind an interval in which the phase turns as no smooth curve does, or is lost in noise.

    Examples
    --------
    >>> import control
    >>> lag = control.tf([1], [0.01, 1])
    >>> round(float(unwrapped_phase_deg(lag, 1e4, delay_s=0.02)), 1)
    -11548.6
    """
    omega = np.asarray(omega_rad_s, dtype=float)
    if not (np.isfinite(omega).all() and (omega > 0.0).all()):
        raise InputError("omega_rad_s: every frequency must be positive and finite")
    flat = np.atleast_1d(omega).ravel()
    if is_measured(system):
        return np.degrees(_measured_phase(system, flat, delay_s)).reshape(omega.shape)
    if hasattr(system, "delays_s"):
        if system.delays_s.size:
            phase = DelayResponse.of(delay_form(system)).phase(flat)
            return np.degrees(phase - flat * delay_s).reshape(omega.shape)
        system = system.to_state_space()
    loop = rational_loop(system)
    x = flat if loop.period_s is None else flat * loop.period_s
    if loop.in_z and (x > math.pi * (1.0 + 1e-12)).any():
        raise InputError(
            f"omega_rad_s: up to the Nyquist frequency {math.pi / (loop.period_s or 1.0):.6g} rad/s"
        )
    return np.degrees(rational_phase(loop, x) - flat * delay_s).reshape(omega.shape)


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


def rational_phase(loop: RationalLoop, x: Real) -> Real:
    """Unwrapped phase of a rational loop in rad; x as in `RationalLoop`."""
    roots, p = zeros(loop), poles(loop)
    at_dc = 1.0 + 0j if loop.in_z else 0j
    at_rest = sorted_poles(loop.A, loop.in_z).at_dc
    p[np.argsort(np.abs(p - at_dc))[:at_rest]] = at_dc  # a cluster of eigenvalues about the exact pole
    near = np.abs(np.concatenate((roots, p)) - at_dc)
    size = float(near.max()) if near.size else 1.0
    first = 1e-3 * float(min(near[near > 1e-7 * size].min(initial=1.0 if loop.in_z else size or 1.0), 1e300))
    everywhere = np.append(x, first)
    factors = factor_phase(roots, everywhere, loop.in_z) - factor_phase(p, everywhere, loop.in_z)
    exact = np.angle(loop.response(everywhere))
    sign = -np.pi if abs(_wrapped(exact[-1:] - factors[-1:])[0]) > 0.5 * np.pi else 0.0
    factors = factors + sign
    correction = _wrapped(exact - factors)
    return (factors + np.where(np.isfinite(correction), correction, 0.0))[
        :-1
    ]  # on a pole: between both sides


def _wrapped(angle: Real) -> Real:
    return angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
