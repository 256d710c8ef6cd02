"""Frequency responses on a grid that suits the loop, for tables and figures; no margin is read from them."""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import schur

from actuator_lti.errors import NumericalError
from actuator_lti.systems.phase import unwrapped_phase_deg
from actuator_lti.systems.resolvent import apart_about_minus_one, apart_in_decibels, refined, responses
from analyses.linear.loop_figures import LoopFigures

DECADES_BELOW = 2.0
DECADES_ABOVE = 1.3
LARGE = 60  # states: a triangular form pays from here on


@dataclass(frozen=True)
class Curve:
    """A frequency response at K frequencies."""

    omega_rad_s: np.ndarray
    values: np.ndarray
    phase_deg: np.ndarray  # unwrapped per factor, so that it does not depend on the grid

    @property
    def frequency_hz(self) -> np.ndarray:
        return self.omega_rad_s / (2.0 * np.pi)

    @property
    def magnitude_db(self) -> np.ndarray:
        """Magnitude in dB; -inf where the response is zero."""
        with np.errstate(divide="ignore"):
            return np.asarray(20.0 * np.log10(np.abs(self.values)))


def curve(system: Any, omega_rad_s: np.ndarray) -> Curve:
    """Evaluate a system over frequencies, positive and at most Nyquist for a sampled one.

    Where the phase cannot be followed (an undamped spring: a zero or pole on the axis), it is that of the
    points, made continuous from one to the next.
    """
    values = response_at(system, omega_rad_s)
    try:
        phase = np.asarray(unwrapped_phase_deg(system, omega_rad_s))
    except NumericalError:
        phase = np.degrees(np.unwrap(np.angle(values)))
    return Curve(omega_rad_s, values, phase - 360.0 * _turns(omega_rad_s, values, phase))


def response_curve(figures: LoopFigures, omega_rad_s: np.ndarray) -> Curve:
    """Evaluate what bandwidth and step of a loop are taken of, the mean of the command included."""
    own, mean = curve(figures.plain_response, omega_rad_s), figures.mean
    if mean is None:
        return own
    values = mean.response(omega_rad_s)
    phase = np.degrees(np.unwrap(np.angle(values)))  # each zero turns it by 180 deg
    return Curve(omega_rad_s, own.values * values, own.phase_deg + phase)


def _turns(omega_rad_s: np.ndarray, values: np.ndarray, phase: np.ndarray) -> float:
    """Whole turns by which the phase at the lowest frequency is off what its slope there leads to.

    A slope of n decades a decade has 90 n deg, less 180 deg for a negative gain. A zero or pole within
    rounding of zero frequency may have been counted on its other side.
    """
    if len(values) < 2 or not (values[:2] != 0.0).all() or not np.isfinite(phase[0]):
        return 0.0
    slope = np.log(np.abs(values[1] / values[0])) / np.log(omega_rad_s[1] / omega_rad_s[0])
    return float(np.ceil((phase[0] - 90.0 * np.round(slope) - 90.0) / 360.0)) if np.isfinite(slope) else 0.0


def response_at(system: Any, omega_rad_s: np.ndarray) -> np.ndarray:
    """Evaluate a system on the stability boundary: at s = jw, or z = exp(jwT) where it is sampled."""
    omega = np.asarray(omega_rad_s, dtype=float)
    points = np.exp(1j * omega * system.dt) if system.dt else 1j * omega
    if not all(hasattr(system, part) for part in "ABCD") or (system.ninputs, system.noutputs) != (1, 1):
        return np.atleast_1d(np.asarray(system(points), dtype=complex))
    if len(system.A) > LARGE and points.size > len(system.A) // 10:
        return _triangular(system, points)
    return responses(system, points)


def _triangular(system: Any, points: np.ndarray) -> np.ndarray:
    """The same by Schur's form, from the last state up, all points at once: for a table or a curve.

    A break point over a whole position period has hundreds of states.
    """
    a, b, c, d = (np.asarray(part, dtype=float) for part in (system.A, system.B, system.C, system.D))
    upper, turned = schur(a, output="complex")
    right, left = (turned.conj().T @ b)[:, 0], (c @ turned)[0]
    if (points[:, None] == np.diagonal(upper)).any():
        return responses(system, points)
    states = np.empty((len(a), points.size), dtype=complex)
    for k in reversed(range(len(a))):
        states[k] = (right[k] + upper[k, k + 1 :] @ states[k + 1 :]) / (points - upper[k, k])
    return np.asarray(left @ states + d[0, 0])


def frequency_grid(figures: LoopFigures, points: int = 240) -> np.ndarray:
    """Give a logarithmic grid around the crossovers of a loop, up to Nyquist where it is sampled.

    The crossovers themselves are points of it.
    """
    margins = figures.margins
    quoted = [m for m in (margins.gain_margin, margins.phase_margin) if m]
    every = [m.frequency_rad_s for m in (*quoted, *margins.gain_margins, *margins.phase_margins)]
    marks = [mark for mark in every if math.isfinite(mark) and mark > 0.0]
    nyquist = math.pi / margins.period_s if margins.period_s else None
    crossings = [m.frequency_rad_s for m in margins.phase_margins if m.frequency_rad_s > 0] or marks
    centre = min(crossings, default=(nyquist or 1e3) / 30.0)
    low = min([centre, *marks[:3]]) / 10**DECADES_BELOW
    high = nyquist or max(centre, *marks[:3], centre) * 10**DECADES_ABOVE
    inside = [mark for mark in marks if low < mark < high]
    grid = np.unique([*np.geomspace(low, high, points), *inside])
    if nyquist is not None:
        grid[-1] = nyquist * (1.0 - 1e-4)  # a zero at z = -1 has turned nothing yet
    return grid


def nyquist_curve(system: Any, omega_rad_s: np.ndarray, frame: float) -> tuple[np.ndarray, np.ndarray]:
    """Sample L(jw) closely enough for a figure of that half width around -1; NaN where it leaves the frame.

    Gives the frequencies, rad/s, and the values.
    """
    apart = partial(apart_about_minus_one, frame=frame)
    omega, values = refined(partial(response_at, system), omega_rad_s, apart)
    shown = np.where(np.abs(values + 1.0) < 2.5 * frame, values, np.nan + 0j)
    kept = [0]  # points that a figure needs: one outside the frame as a gap, none too near to be told apart
    for k, value in enumerate(shown[1:], 1):
        last = shown[kept[-1]]
        if np.isnan(value) != np.isnan(last) or abs(value - last) > 0.006 * frame:
            kept.append(k)
    return omega[kept], shown[kept]


def nichols_curve(system: Any, omega_rad_s: np.ndarray, span_db: float) -> Curve:
    """Sample L(jw) closely enough for a Nichols chart that goes so far up and down."""
    apart = partial(apart_in_decibels, span_db=span_db)
    return curve(system, refined(partial(response_at, system), omega_rad_s, apart)[0])
