"""What the drive can do at a load, in closed form: output rate, motor current, acceleration.

Steady motion and the first instant of it; the worse of the two directions, with the hinge moment against
the motion where the load path is back-drivable.  Sources: paper, equations (1), (2), (9); model.md section 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.static_threshold import stall_torque_Nm


@dataclass(frozen=True)
class DriveFigures:
    """Figures of the whole drive at one hinge moment; output side in rad (linear axis: m).

    Attributes
    ----------
    load_Nm : float
        Hinge moment at the output shaft.
    output_rate_rad_s : float
        Largest steady speed of the output within the speed, voltage and peak current limits; 0 if it
        cannot move; ``inf`` without any limit.
    rate_limit : str
        What sets it: ``"speed limit"``, ``"voltage"``, ``"force"`` or ``"nothing"``.
    motor_current_A : float or None
        Current needed at that speed; ``None`` without a motor current (ideal source) or where the speed has
        no bound.
    acceleration_rad_s2 : float
        Largest acceleration of the output from rest, within the acceleration limit; 0 if it cannot move.
    acceleration_limit : str
        ``"acceleration limit"`` or ``"torque"``.
    """

    load_Nm: float
    output_rate_rad_s: float
    rate_limit: str
    motor_current_A: float | None
    acceleration_rad_s2: float
    acceleration_limit: str


def drive_figures(design: Design, load_Nm: float = 0.0) -> DriveFigures:
    """Rate, current and acceleration of a drive at a hinge moment.

    Parameters
    ----------
    design : Design
    load_Nm : float
        Hinge moment at the output shaft, N m (linear axis: N), either sign.

    Raises
    ------
    InputError
        If the load is not finite.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> found = drive_figures(load_design("ilr33-amber"), load_Nm=8.0)
    >>> round(found.motor_current_A, 3), found.rate_limit
    (3.037, 'speed limit')
    """
    if not math.isfinite(load_Nm):
        raise InputError(f"load_Nm = {load_Nm}: must be finite")
    return min((_one_way(design, load_Nm, direction) for direction in (1, -1)), key=_rank)


def _rank(found: DriveFigures) -> tuple[float, float, float]:
    """Order the directions: the slower, then the weaker, then the one that needs more current."""
    return (found.output_rate_rad_s, found.acceleration_rad_s2, -(found.motor_current_A or 0.0))


def _one_way(design: Design, load_Nm: float, direction: int) -> DriveFigures:
    """Give the figures for one direction of motion."""
    ratio = design.total_ratio
    against = _resistance_Nm(design, load_Nm, direction)
    viscous = design.friction.viscous(direction)
    speed, why = _top_speed(design, against, viscous)
    current = None
    k_M = design.motor.torque_constant_Nm_A
    if design.motor.has_electrical_dynamics and k_M and math.isfinite(speed):
        current = (against + viscous * speed) / k_M
    torque = stall_torque_Nm(design)
    free = max(torque - against * design.friction.breakaway_ratio, 0.0)
    gain = max(torque - against, 0.0) / design.inertia_kgm2 if free > 0.0 else 0.0
    limit = design.limits.acceleration_rad_s2
    cause = "acceleration limit" if limit < gain else "torque"
    return DriveFigures(load_Nm, speed / ratio, why, current, min(gain, limit) / ratio, cause)


def _resistance_Nm(design: Design, load_Nm: float, direction: int) -> float:
    """Give the constant torque against motion at the motor: dry friction, offset, load where it passes."""
    friction = design.friction
    total = friction.dry_Nm(load_Nm, direction) + direction * friction.offset_torque_Nm
    if design.load.path == "back-drivable":
        total += abs(load_Nm) / design.total_ratio
    return total


def _top_speed(design: Design, against: float, viscous: float) -> tuple[float, str]:
    """Give the largest steady motor speed and what sets it."""
    motor, limits = design.motor, design.limits
    if stall_torque_Nm(design) <= against:
        return 0.0, "force"
    bounds = [(math.inf, "nothing")]
    if design.controller.velocity is not None:
        bounds.append((limits.speed_rad_s, "speed limit"))
    if viscous > 0.0:
        bounds.append(((stall_torque_Nm(design) - against) / viscous, "force"))
    if motor.source_gain_Nm_V is None:
        assert motor.resistance_ohm is not None
        assert motor.torque_constant_Nm_A is not None
        assert motor.back_emf_constant_Vs_rad is not None
        drop = motor.resistance_ohm / motor.torque_constant_Nm_A
        slope = motor.back_emf_constant_Vs_rad + drop * viscous
        bounds.append(((limits.voltage_V - drop * against) / slope, "voltage"))
    return min(bounds, key=lambda bound: bound[0])
