"""Lost motion: the output over a slow triangle at the command, up and down."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.operating import dry_torque
from analyses.linear.static_threshold import StaticThreshold
from nonlinear import commands, simulate

SPAN = 25.0  # amplitude over the threshold
PERIOD_SETTLINGS = 16  # settling times (to a thousandth) in one period
LEAST_TICKS = 4000
POINTS = 500


@dataclass(frozen=True)
class Hysteresis:
    """One settled period of a slow triangle at the command.

    Attributes
    ----------
    amplitude_rad, frequency_hz : float
        Of the triangle; the width depends on its rate where a controller integrates.
    command_rad, output_rad : ndarray
        One period, thinned.
    width_rad : float
        Output falling less output rising, both where the command passes zero.
    linear_width_rad : float
        The same without dry friction: what the loop lags by at this rate.
    largest_rad : float
        Largest distance of the output from what it would be without dry friction, anywhere in the period.
    predicted_rad : float or None
        Width by ``2 Tc/stiffness`` where nothing integrates; else ``None``: the integral takes the width
        away in the end, and what remains, after each reversal, depends on the rate.
    """

    amplitude_rad: float
    frequency_hz: float
    command_rad: np.ndarray
    output_rad: np.ndarray
    width_rad: float
    linear_width_rad: float
    largest_rad: float
    predicted_rad: float | None

    @property
    def lost_motion_rad(self) -> float:
        """What friction adds to the width."""
        return self.width_rad - self.linear_width_rad


def hysteresis(design: Design, load_Nm: float, static: StaticThreshold, settling_ticks: int) -> Hysteresis:
    """Simulate a slow triangle with and without dry friction and compare the two branches."""
    ticks = max(PERIOD_SETTLINGS * settling_ticks, LEAST_TICKS)
    every = design.controller.position_loop.every
    ticks = 4 * every * round(ticks / (4 * every))
    period = ticks * design.controller.period_s
    smallest = min(design.validation.amplitude_fractions) * design.validation.full_deflection_rad
    amplitude = min(SPAN * static.forward_rad, smallest)
    command = commands.triangle(amplitude, 1.0 / period)
    widths, outputs = [], []
    for friction_on in (False, True):
        run = simulate(design, command, 2.0 * period, load_Nm, friction_on=friction_on)
        y = run.output_angle_rad[-ticks:]
        widths.append(float(y[ticks // 2] - y[0]))
        outputs.append(y)
    shown = slice(-ticks, None, max(1, ticks // POINTS))
    predicted = None
    if static.integral_time_s is None:
        both = dry_torque(design, load_Nm, 1) + dry_torque(design, load_Nm, -1)
        predicted = float(both) / static.torque_gain_Nm_rad
    return Hysteresis(
        amplitude, 1.0 / period, run.reference_rad[shown], run.output_angle_rad[shown],
        widths[1], widths[0], float(np.max(np.abs(outputs[1] - outputs[0]))), predicted,
    )  # fmt: skip
