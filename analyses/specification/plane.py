"""The torque-speed plane of the motor: what bounds it, and what friction asks for at each load torque."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.facts import circuit_resistance_ohm, stall_torque_Nm

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
        assert motor.resistance_ohm is not None
        assert motor.torque_constant_Nm_A is not None
        assert motor.back_emf_constant_Vs_rad is not None
        k_M, k_E = motor.torque_constant_Nm_A, motor.back_emf_constant_Vs_rad
        R = circuit_resistance_ohm(design)
        if math.isfinite(limits.voltage_V):
            no_load = limits.voltage_V / k_E
            line = np.linspace(0.0, no_load, POINTS)
            bounds.append(Curve("voltage limit", line, k_M * (limits.voltage_V - k_E * line) / R))
        if design.controller.current is not None:
            level("peak current", k_M * limits.peak_current_A)
        level("continuous current", k_M * limits.continuous_current_A)
    if design.controller.velocity is not None and math.isfinite(limits.speed_rad_s):
        high = max((float(curve.torque_Nm.max()) for curve in bounds), default=1.0)
        bounds.append(Curve("speed limit", np.full(2, limits.speed_rad_s), np.array([0.0, high])))
    demands = tuple(_demand(design, load, speed) for load in design.validation.loads_Nm)
    return TorqueSpeedPlane(tuple(bounds), demands)


def _demand(design: Design, load_Nm: float, speed: np.ndarray) -> Curve:
    """Torque for steady motion forward."""
    friction = design.friction
    torque = friction.dry_Nm(load_Nm, 1) + friction.offset_torque_Nm + friction.viscous(1) * speed
    if design.load.path == "back-drivable":
        torque = torque + abs(load_Nm) / design.total_ratio
    unit = "N" if design.axis == "linear" else "N m"
    return Curve(f"steady motion at {load_Nm:g} {unit}", speed, torque)
