"""What the response to the command leaves out as it is not linear: rate and acceleration of the command."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, log10, pi

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.profile import profile_onset_rad
from actuator_lti.loops import assemble_loops
from analyses.large_signal.grid import tone
from analyses.large_signal.steady_start import linear_steady_state
from analyses.large_signal.tones_run import run_tones


@dataclass(frozen=True)
class CommandLimits:
    """A sine of full deflection behind rate and acceleration limit of the command."""

    # Asked for, and simulated: a whole number of ticks is a period
    frequency_hz: float
    tone_hz: float
    onset_rad: float  # peak command from which on one of the two acts, output side
    amplitude_rad: float  # of the sine: full deflection
    # Simulated fundamental of the output over the command; ``None`` where neither acts at full deflection
    gain_db: float | None
    share: float  # of the time that one of them acts

    def words(self, scale: float, unit: str) -> str:
        """The same in a sentence, amplitudes times a scale."""
        said = (
            "rate and acceleration of the command are not in it: they act above "
            f"{scale * self.onset_rad:.3g} {unit} at {self.frequency_hz:.3g} Hz"
        )
        if self.gain_db is None:
            return f"{said}, beyond full deflection"
        return (
            f"{said}; simulated at {scale * self.amplitude_rad:.3g} {unit} and {self.tone_hz:.3g} Hz: "
            f"{self.gain_db:.3g} dB, {100.0 * self.share:.0f} % of the time limited"
        )


def command_limits(design: Design, frequency_hz: float) -> CommandLimits | None:
    """Simulate a sine of full deflection where rate or acceleration of the command limit it.

    ``None`` where the command has neither, or the drive no position loop. The frequency is such as the
    bandwidth of the response to the command.
    """
    full = design.validation.full_deflection_rad
    onset = float(profile_onset_rad(design, np.array([2.0 * pi * frequency_hz]))[0])
    if onset == inf:
        return None
    if onset >= full:
        return CommandLimits(frequency_hz, frequency_hz, onset, full, None, 0.0)
    chosen = tone(frequency_hz, design)
    start = linear_steady_state(assemble_loops(design), np.array([chosen.omega_rad_s]))
    amplitude, nothing = np.array([full]), np.zeros(1)
    run = run_tones(design, (chosen,), np.zeros(1, dtype=int), amplitude, start, nothing, insist=True)
    gain = float(abs(run.phasor("output_angle_rad")[0])) / full
    share = float(run.window_limit_fraction("profile")[0])
    gain_db = 20.0 * log10(gain) if gain else -inf
    return CommandLimits(frequency_hz, chosen.frequency_hz, onset, full, gain_db, share)


def said_of(design: Design, frequency_hz: float | None) -> str:
    """What `command_limits` finds, in words; empty where there is nothing to say."""
    if frequency_hz is None or not 0.0 < frequency_hz < inf:
        return ""
    found = command_limits(design, frequency_hz)
    scale, unit = (1e3, "mm") if design.axis == "linear" else (180.0 / pi, "deg")
    return "" if found is None else found.words(scale, unit)
