"""Rate, acceleration and current at each load torque, in closed form and simulated."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Command, Design
from actuator_lti.drive import facts
from analyses.specification.manoeuvres import thermal_duty
from nonlinear import commands, simulate

LONGEST_TICKS = 40_000
STEADY_SHARE = 0.1


@dataclass(frozen=True)
class DriveFigures:
    """Figures of the whole drive at one load torque; output side in rad (linear axis: m)."""

    load_Nm: float  # load torque at the output shaft
    # Largest steady speed of the output within the speed, voltage and peak current limits; 0 if it cannot
    # move; ``inf`` without any limit
    output_rate_rad_s: float
    rate_limit: str  # what sets it: one of `actuator_lti.drive.facts.RATE_LIMITS`
    # Current needed at that speed; ``None`` without a motor current (ideal source) or where the speed has no
    # bound
    motor_current_A: float | None
    # Largest acceleration of the output from rest, within the acceleration limit; 0 if it cannot move
    acceleration_rad_s2: float


def drive_figures(design: Design, load_Nm: float = 0.0) -> DriveFigures:
    """Rate, current and acceleration of a drive at a load at the output, N m (linear axis: N), either sign.

    Raises `InputError`: if the load is not finite.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> result = drive_figures(load_design("ilr33-amber"), load_Nm=8.0)
    >>> round(result.motor_current_A, 3), result.rate_limit
    (3.037, 'speed limit')
    """
    capacity = facts.capability(design, load_Nm)
    current = float(capacity.motor_current_A)
    return DriveFigures(
        load_Nm=load_Nm,
        output_rate_rad_s=float(capacity.output_rate_rad_s),
        rate_limit=facts.RATE_LIMITS[int(capacity.rate_limit)],
        motor_current_A=None if math.isnan(current) else current,
        acceleration_rad_s2=float(capacity.acceleration_rad_s2),
    )


@dataclass(frozen=True)
class Capability:
    """What the drive can do at one load torque; output side unless a name says motor."""

    figures: DriveFigures  # in closed form
    # Steady rate when the command runs away from the output; ``None`` where the rate has no bound, or was not
    # reached in the time that a run may take
    simulated_rate_rad_s: float | None
    # Largest mean acceleration over a stretch of the start, from rest
    simulated_acceleration_rad_s2: float | None
    simulated_current_A: float | None  # mean motor current at the steady rate
    current_ratio: float | None  # that current over the continuous current
    duty: float | None  # share of the time in which that current may flow (`thermal_duty`)


def capability(design: Design, load_Nm: float, settling_s: float) -> Capability:
    """Run the command away from the output and read what the drive makes of it.

    Behind the profile of the command, and without what depends on the angle: at one load, as the figures are.
    """
    design = replace(design, command=Command(), load=design.load.level(), motor=design.motor.level())
    figures = drive_figures(design, load_Nm)
    rate, push = figures.output_rate_rad_s, figures.acceleration_rad_s2
    current, continuous = figures.motor_current_A, design.limits.continuous_current_A
    ratio = current / continuous if current is not None and math.isfinite(continuous) else None
    duty = thermal_duty(design, current)
    if not (0.0 < rate < math.inf and 0.0 < push < math.inf):
        return Capability(figures, None, None, None, ratio, duty)
    friction = design.friction  # the way that meets the greater resistance
    forward = friction.dry_Nm(load_Nm, 1) + friction.offset_torque_Nm
    direction = 1 if forward >= friction.dry_Nm(load_Nm, -1) - friction.offset_torque_Nm else -1
    Ts = design.controller.period_s
    force_bound = figures.rate_limit == "force" and friction.viscous(1) > 0.0
    viscous_s = design.inertia_kgm2 / friction.viscous(direction) if force_bound else 0.0
    time = min(12.0 * rate / push + 8.0 * settling_s + 8.0 * viscous_s, LONGEST_TICKS * Ts)
    load = direction * -abs(load_Nm) if design.load.path == "back-drivable" else load_Nm
    run = simulate(design, commands.ramp(direction * 3.0 * rate), time, load)
    speed = direction * run.motor_speed_rad_s / design.total_ratio
    tail = max(4, int(STEADY_SHARE * speed.size))
    steady = float(speed[-tail:].mean())
    settled = abs(float(speed[-1] - speed[-tail])) < 2e-3 * abs(steady)
    found_current = abs(float(run.current_A[-tail:].mean())) if design.motor.has_electrical_dynamics else None
    return Capability(
        figures,
        steady if settled else None,
        _acceleration(design, load, direction, rate, push),
        found_current if settled else None,
        ratio,
        duty,
    )


def _acceleration(design: Design, load_Nm: float, direction: int, rate: float, push: float) -> float:
    """Largest mean acceleration over a tenth of the run-up after a step far away."""
    Ts = design.controller.period_s
    stretch = max(2, round(0.1 * rate / push / Ts))
    command = commands.step(direction * 1e3 * (rate * Ts + design.validation.full_deflection_rad))
    run = simulate(design, command, (14 * stretch + 20) * Ts, load_Nm)
    speed = direction * run.motor_speed_rad_s / design.total_ratio
    return float(np.max(speed[stretch:] - speed[:-stretch])) / (stretch * Ts)
