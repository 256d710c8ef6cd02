"""A measured frequency response, and how far it lies from an assembled loop."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from analyses.responses import response_at

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]
Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Sweep:
    """A measured frequency response at one break point.

    Attributes
    ----------
    design_name, loop, point : str
    period_s : float
        Sampling period of the loop at the point.
    frequency_hz : ndarray, shape (K,)
    open_loop, closed_loop, sensitivity, plant : ndarray of complex, shape (K,)
        L, T = L/(1 + L), S = 1/(1 + L); the plant from the signal behind the instrument to the motor's
        current (``u``) or speed, at every tick.  NaN where ``valid`` is False.
    amplitude : ndarray, shape (K,)
        Injected, peak, in the unit of the point.
    distortion : ndarray, shape (K,)
        Everything but mean and fundamental in front of the instrument, relative to the larger fundamental on
        either side of it (rms; the stairs of a held signal are no distortion, the images of a periodically
        time-varying loop are).
    unsteadiness : ndarray, shape (K,)
        Relative change of the fundamental between the last two windows.
    ticks : ndarray, shape (K,)
        Length of each run, waiting and windows.
    reason : tuple of str
        Empty where the point is valid; otherwise ``"not steady"``, the limiter that acted, or ``"speed
        reversal"``.
    speed_rad_s : float
        Of the bias motion, motor side.
    error : ndarray, shape (K,), optional
        Relative error of the closed loop where the measurement knows it without windows.
    """

    design_name: str
    loop: str
    point: str
    period_s: float
    frequency_hz: Floats
    open_loop: Complexes
    closed_loop: Complexes
    sensitivity: Complexes
    plant: Complexes
    amplitude: Floats
    distortion: Floats
    unsteadiness: Floats
    ticks: Floats
    reason: tuple[str, ...]
    speed_rad_s: float
    error: Floats | None = None

    @property
    def valid(self) -> Flags:
        """Which points are steady, without a limit and without a reversal."""
        return np.array([not text for text in self.reason])

    def joined(self, other: Sweep) -> Sweep:
        """Both sweeps of the same loop as one, in order of frequency."""
        order = np.argsort(np.concatenate([self.frequency_hz, other.frequency_hz]), kind="stable")
        both: dict[str, Any] = {
            name: np.concatenate([getattr(self, name), getattr(other, name)])[order] for name in ARRAYS
        }
        reasons = (*self.reason, *other.reason)
        return replace(self, reason=tuple(reasons[k] for k in order), **both)


ARRAYS = (
    "frequency_hz",
    "open_loop",
    "closed_loop",
    "sensitivity",
    "plant",
    "amplitude",
    "distortion",
    "unsteadiness",
    "ticks",
)

PLAIN = {"open_loop": "plain_open", "closed_loop": "plain_closed", "sensitivity": "plain_sensitivity"}
"""What a loop holds of each measured response."""


@dataclass(frozen=True)
class SweepErrors:
    """Measured less linear, point by point; NaN where a point is not valid."""

    gain_db: Floats
    phase_deg: Floats

    @property
    def worst_gain_db(self) -> float:
        """Largest magnitude of the gain error."""
        return float(np.nanmax(np.abs(self.gain_db), initial=0.0))

    @property
    def worst_phase_deg(self) -> float:
        """Largest magnitude of the phase error."""
        return float(np.nanmax(np.abs(self.phase_deg), initial=0.0))


def sweep_errors(sweep: Any, loop: Any, response: str = "open_loop") -> SweepErrors:
    """Compare a sweep (`Sweep`, `ToneSweep`) with an assembled loop (`actuator_lti.loops.Loop`, sampled).

    Parameters
    ----------
    response : {"open_loop", "closed_loop", "sensitivity"}
    """
    return errors_beside(sweep, getattr(loop, PLAIN[response]), response)


def errors_beside(sweep: Any, system: Any, response: str = "open_loop") -> SweepErrors:
    """Compare a response of a sweep with that of a linear system."""
    ratio = getattr(sweep, response) / linear_response(system, sweep.frequency_hz)
    return SweepErrors(20.0 * np.log10(np.abs(ratio)), np.degrees(np.angle(ratio)))


def linear_response(system: Any, frequency_hz: npt.ArrayLike) -> Complexes:
    """Response of a sampled system at frequencies in Hz."""
    omega = 2.0 * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    return response_at(system, omega)
