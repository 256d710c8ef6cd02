"""The command to the output without bias motion, where dry friction has no small-signal gain.

Each frequency is commanded from rest at a stated amplitude and compared twice: with the sliding loop, which
cannot hold here, and with the describing-function operating point at the speed amplitude that was seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.drive.operating import Operating
from actuator_lti.drive.profile import command_mean
from actuator_lti.drive.wiring import wire
from actuator_lti.errors import InputError
from actuator_lti.loops import Loops
from actuator_lti.loops.limiters import onset
from actuator_lti.loops.sampled import reference_to_output
from analyses.large_signal.classify import limiter_fractions
from analyses.large_signal.tones import TANH_TOLERANCE, tone
from analyses.linear.responses import response_at
from nonlinear import LIMITERS, Rows

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]
NO_MOTION = 1e-3  # of the command
UPDATES = 400  # of the position loop in a window


@dataclass(frozen=True)
class RestSweep:
    """Response from rest, one entry a frequency."""

    # Shape (K,): command at the output shaft, peak
    frequency_hz: Floats
    amplitude_rad: Floats
    # Shape (K,): output over command: simulated; sliding loop; describing function at ``speed_rad_s`` (NaN
    # where nothing moves)
    measured: Complexes
    sliding: Complexes
    described: Complexes
    speed_rad_s: Floats  # shape (K,): amplitude of the motor speed that was seen
    # Shape (K,): of the last window; distortion of the motor speed
    stick_fraction: Floats
    distortion: Floats
    unsteadiness: Floats
    limiter: tuple[str, ...]  # limit that acted in the last window, or empty


def sweep_from_rest(
    design: Design,
    frequency_hz: npt.ArrayLike,
    amplitude_rad: npt.ArrayLike,
    settle_ticks: int,
    *,
    described: bool = True,
) -> RestSweep:
    """Command sines from rest and compare with the describing function of dry friction, where ``described``.

    The amplitude is that of the command at the output, one for all or one a frequency, shape (K,).
    """
    tick_s, n = design.controller.period_s, design.controller.position_loop.every
    asked = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    if not (asked > 0.0).all() or not (asked < 0.5 / (n * tick_s)).all():
        raise InputError(f"frequency_hz: positive and below {0.5 / (n * tick_s):g} Hz (Nyquist)")
    tones = [tone(float(hz), design, UPDATES, least_cycles=2) for hz in asked]
    hertz, ticks, cycles = np.array([(t.frequency_hz, t.ticks, t.cycles) for t in tones]).T
    amplitude = np.broadcast_to(np.asarray(amplitude_rad, dtype=float), asked.shape).copy()
    rows = Rows.of(design, asked.size)
    rows["tanh_tolerance"] = TANH_TOLERANCE
    rows["ticks"] = settle_ticks + 2 * ticks + np.ceil(4 * ticks / cycles)
    rows.window(ticks, cycles)
    rows.sine("command", amplitude, hertz)
    result = rows.run()
    measured = result.phasor("output_angle_rad") / amplitude
    speed = np.abs(result.phasor("motor_speed_rad_s"))
    moving = np.abs(measured) > NO_MOTION
    expected = np.full(asked.size, np.nan, complex)
    for k in np.flatnonzero(moving & described):
        expected[k] = _linear(design, hertz[k : k + 1], float(speed[k]))[0]
    return RestSweep(
        frequency_hz=hertz,
        amplitude_rad=amplitude,
        measured=measured,
        sliding=_linear(design, hertz, None),
        described=expected,
        speed_rad_s=speed,
        stick_fraction=result.window_stick_fraction,
        distortion=result.distortion("motor_speed_rad_s"),
        unsteadiness=result.unsteadiness("output_angle_rad"),
        limiter=tuple(LIMITERS[np.argmax(row)] if row.any() else "" for row in limiter_fractions(result)),
    )


def _linear(design: Design, frequency_hz: Floats, speed_rad_s: float | None) -> Complexes:
    """Command to output at frequencies; sliding, or described at a speed amplitude.

    The output is looked at in every tick, as the simulator does; at the instants of the position loop the
    answer is the same but for the images of a held signal.
    """
    point = "sliding" if speed_rad_s is None else "describing-function"
    at = Operating(point=point, speed_amplitude_rad_s=speed_rad_s)  # type: ignore[arg-type]
    omega, mean = 2.0 * np.pi * frequency_hz, command_mean(design)
    response = response_at(reference_to_output(wire(design, at)), omega)
    return response if mean is None else response * mean.response(omega)


def free_amplitude(design: Design, loops: Loops, frequency_hz: Floats, part: float) -> Floats:
    """Command amplitude: a part of full deflection, at most half of what reaches a limit."""
    full = design.validation.full_deflection_rad
    border = onset(loops, 2.0 * np.pi * frequency_hz).amplitude_rad
    return np.minimum(part * full, 0.5 * border)
