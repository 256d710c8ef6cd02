"""The torque-speed plane of the motor: what bounds it, and what friction asks for at each load torque."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.facts import stall_torque_Nm
from actuator_lti.drive.steady import (
    motor_torque_Nm,
    no_load_speed_rad_s,
    steady_torque_Nm,
    voltage_limit_torque_Nm,
)

POINTS = 41


@dataclass(frozen=True)
class Curve:
    """A line in the plane: motor speed (rad/s) and motor torque (N m)."""

    name: str
    speed_rad_s: np.ndarray
    torque_Nm: np.ndarray


@dataclass(frozen=True)
class TorqueSpeedPlane:
    """Motor side, first quadrant.

    Attributes
    ----------
    bounds : tuple of Curve
        Voltage line, peak current, continuous current, speed limit; those that exist.
    demands : tuple of Curve
        Friction (and load, where it passes) in steady motion at each load torque.
    """

    bounds: tuple[Curve, ...]
    demands: tuple[Curve, ...]


def torque_speed_plane(design: Design, top_speed_rad_s: float) -> TorqueSpeedPlane:
    """Draw up the plane up to a little above the top speed.

    Sources: equation (1) in steady motion, ``u = R i + kE w``; equation (9).
    """
    motor, limits = design.effective_motor, design.limits
    top = top_speed_rad_s if 0.0 < top_speed_rad_s < math.inf else 1.0
    speed = np.linspace(0.0, 1.25 * top, POINTS)
    bounds = []

    def level(name: str, torque: float) -> None:
        if math.isfinite(torque):
            bounds.append(Curve(name, speed[[0, -1]], np.full(2, torque)))

    if motor.source_gain_Nm_V is not None:
        level("drive signal at its limit", stall_torque_Nm(design))
    else:
        if math.isfinite(limits.voltage_V):
            line = np.linspace(0.0, no_load_speed_rad_s(design), POINTS)
            bounds.append(Curve("voltage limit", line, voltage_limit_torque_Nm(design, line)))
        if design.controller.current is not None:
            level("peak current", motor_torque_Nm(design, limits.peak_current_A, math.nan))
        level("continuous current", motor_torque_Nm(design, limits.continuous_current_A, math.nan))
    if design.controller.velocity is not None and math.isfinite(limits.speed_rad_s):
        high = max((float(curve.torque_Nm.max()) for curve in bounds), default=1.0)
        bounds.append(Curve("speed limit", np.full(2, limits.speed_rad_s), np.array([0.0, high])))
    demands = tuple(_demand(design, load, speed) for load in design.validation.loads_Nm)
    return TorqueSpeedPlane(tuple(bounds), demands)


def _demand(design: Design, load_Nm: float, speed: np.ndarray) -> Curve:
    """Torque for steady motion forward."""
    unit = "N" if design.axis == "linear" else "N m"
    return Curve(f"steady motion at {load_Nm:g} {unit}", speed, steady_torque_Nm(design, load_Nm, speed))
