"""The one part of the command's profile that is always linear: the mean that limits its jerk.

Rate and acceleration limits leave a command alone that keeps them; the jerk limit is a mean over the last n
samples of the position loop, n = 2 a/(j T) rounded up, and acts on every command (model.md section 7).
"""

from dataclasses import dataclass
from math import asin, ceil, inf, pi, sin, sqrt
from typing import Any

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.systems.root import root

RESOLVED = 1e-13  # of the command: what sin(k pi) leaves of a zero of the mean


@dataclass(frozen=True)
class CommandMean:
    """Mean over the last samples of the command."""

    samples: int
    period_s: float  # of the position loop

    @property
    def delay_s(self) -> float:
        """By how much a slow command comes later: (n - 1) T/2, at every frequency below the first zero."""
        return 0.5 * (self.samples - 1) * self.period_s

    @property
    def first_zero_rad_s(self) -> float:
        return 2.0 * pi / (self.samples * self.period_s)

    def response(self, omega_rad_s: np.ndarray) -> np.ndarray:
        """``sin(n w T/2)/(n sin(w T/2)) exp(-j w (n - 1) T/2)``."""
        half = 0.5 * np.asarray(omega_rad_s, dtype=float) * self.period_s
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = np.sin(self.samples * half) / (self.samples * np.sin(half))
        gain = np.where(np.sin(half) == 0.0, 1.0, np.where(np.abs(gain) < RESOLVED, 0.0, gain))
        return np.asarray(gain * np.exp(-1j * half * (self.samples - 1)))

    @property
    def minus3db_rad_s(self) -> float:
        """Where its gain is 1/sqrt(2): 2.783/(n T) for many samples."""

        def over(half: float) -> float:
            return sin(self.samples * half) / (self.samples * sin(half)) - sqrt(0.5)

        return 2.0 / self.period_s * root(over, 1e-9 / self.samples, pi / self.samples)


def command_mean(design: Design) -> CommandMean | None:
    command, control = design.command, design.controller
    if control.position is None or command.jerk_rad_s3 == inf or command.acceleration_rad_s2 == inf:
        return None
    period = control.position.every * control.period_s
    samples = ceil(2.0 * command.acceleration_rad_s2 / (command.jerk_rad_s3 * period) - 1e-9)
    return CommandMean(samples, period) if samples > 1 else None


def sampled_rate_rad_s(omega_rad_s: Any, period_s: Any) -> Any:
    """Largest change per time of the samples of a sine of peak 1, T apart: 2 sin(w T/2)/T."""
    return 2.0 * np.sin(0.5 * np.asarray(omega_rad_s, dtype=float) * period_s) / period_s


def profile_onset_rad(design: Design, omega_rad_s: np.ndarray) -> np.ndarray:
    """Peak of a sine command from which on its rate or acceleration limit acts; ``inf`` without any."""
    command, control = design.command, design.controller
    if control.position is None:
        return np.full(np.shape(omega_rad_s), inf)
    per_peak = sampled_rate_rad_s(omega_rad_s, control.position.every * control.period_s)
    return np.asarray(np.minimum(command.rate_rad_s / per_peak, command.acceleration_rad_s2 / per_peak**2))


def profile_passes_rad_s(design: Design, peak_rad: float) -> float:
    """Up to which frequency a sine command of a peak keeps rate and acceleration; ``inf``: at all."""
    command, control = design.command, design.controller
    if control.position is None:
        return inf
    period = control.position.every * control.period_s
    per_peak = min(command.rate_rad_s / peak_rad, sqrt(command.acceleration_rad_s2 / peak_rad))
    return inf if per_peak >= 2.0 / period else 2.0 / period * asin(0.5 * period * per_peak)


def profile_note(design: Design) -> str:
    """What the mean of the command does to the response to it; empty where there is none."""
    mean = command_mean(design)
    if mean is None:
        return ""
    return (
        f"command.jerk: the drive takes the mean of its command over {mean.samples} samples. The response to "
        f"the command has it, that to the reference has not: {1e3 * mean.delay_s:.4g} ms later, -3 dB by "
        f"itself at {mean.minus3db_rad_s / (2 * pi):.4g} Hz"
    )
