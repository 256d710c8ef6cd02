"""Cycles of dry friction by its describing function inside the exact sampled loop.

For a sinusoidal speed of amplitude W dry friction acts as the slope ``4 Tc/(pi W)``.  A cycle is predicted
where an oscillating eigenvalue of the whole closed loop with that slope lies on the unit circle. The
breakaway torque has no part in it: at rest a sinusoid spends no time.
"""

from __future__ import annotations

from dataclasses import replace
from math import exp, log

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.operating import Operating, dry_torque
from analyses.limit_cycles.describing import Mode, kept_up, mode_at, output_of
from analyses.limit_cycles.result import Cycle

POINTS = 36
DECADES = 6.0


def cycles_of_friction(design: Design, load_Nm: float, top_speed_rad_s: float) -> tuple[Cycle, ...]:
    """Every cycle with a motor speed up to ``top_speed_rad_s``, over six decades."""

    def mode(log_speed: float, _: Mode | None) -> Mode | None:
        at = Operating(point="describing-function", load_Nm=load_Nm, speed_amplitude_rad_s=exp(log_speed))
        return mode_at(design, at)

    grid = log(top_speed_rad_s) - np.linspace(DECADES, 0.0, POINTS) * log(10.0)
    return tuple(
        _cycle(design, load_Nm, exp(log_speed), there, stable=stable)
        for log_speed, there, stable in kept_up(mode, grid)
    )


def _cycle(design: Design, load_Nm: float, speed: float, mode: Mode, *, stable: bool) -> Cycle:
    state = {name: speed / mode.shape["w"] * value for name, value in mode.shape.items()}
    output = abs(output_of(design, state))
    return Cycle("friction", True, output, speed, mode.frequency_hz, stable, state, load_Nm)


def at_load(cycle: Cycle, design: Design, load_Nm: float) -> Cycle:
    """The same cycle at another load torque: the slope at the border is the same, so W goes with Tc."""
    ratio = dry_Nm(design, load_Nm) / dry_Nm(design, cycle.load_Nm)
    return replace(
        cycle,
        inner_rad=ratio * cycle.inner_rad,
        output_rad=ratio * cycle.output_rad,
        state={name: ratio * value for name, value in cycle.state.items()},
        load_Nm=load_Nm,
    )


def dry_Nm(design: Design, load_Nm: float) -> float:
    """Dry friction at the motor, forward and backward together; of a friction map that at its first point."""
    return float(dry_torque(design, load_Nm, 1) + dry_torque(design, load_Nm, -1))
