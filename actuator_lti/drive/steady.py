"""The drive in steady motion: torque, current and voltage that belong together (equations (1), (2) at rest).

Everything outside `actuator_lti.drive` that needs ``u = R i + kE w`` or ``M = kM i`` asks here.
"""

from __future__ import annotations

from typing import Any

from actuator_lti.design.model import Design, Motor
from actuator_lti.drive.facts import circuit_resistance_ohm, resistance_Nm, speed_torque_Nm


def motor_torque_Nm(design: Design, current_A: Any, voltage_V: Any) -> Any:
    """``kM i``, or the gain times the drive signal of an ideal source."""
    motor = design.effective_motor
    if motor.source_gain_Nm_V is not None:
        return motor.source_gain_Nm_V * voltage_V
    assert motor.torque_constant_Nm_A is not None
    return motor.torque_constant_Nm_A * current_A


def steady_torque_Nm(design: Design, load_Nm: float, speed_rad_s: Any) -> Any:
    """Motor torque for a steady motion forward against a load, friction and damping on the way."""
    return resistance_Nm(design, load_Nm, 1) + speed_torque_Nm(design, speed_rad_s)


def steady_input(design: Design, torque_Nm: Any, speed_rad_s: Any) -> tuple[Any, Any]:
    """Current (0 of an ideal source) and voltage at a motor torque and speed: ``i = M/kM``, equation (1)."""
    motor = design.effective_motor
    if motor.source_gain_Nm_V is not None:
        return 0.0 * torque_Nm, torque_Nm / motor.source_gain_Nm_V
    assert motor.torque_constant_Nm_A is not None
    current = torque_Nm / motor.torque_constant_Nm_A
    return current, steady_voltage_V(design, current, speed_rad_s)


def steady_voltage_V(design: Design, current_A: Any, speed_rad_s: Any) -> Any:
    """``u = R i + kE w`` of a motor with a winding."""
    R, _, kE = _winding(design.effective_motor)
    return R * current_A + kE * speed_rad_s


def voltage_limit_torque_Nm(design: Design, speed_rad_s: Any) -> Any:
    """Torque at the voltage limit and a speed, ``kM (U - kE w)/(R + R_s)``."""
    _, kM, kE = _winding(design.effective_motor)
    return kM * (design.limits.voltage_V - kE * speed_rad_s) / circuit_resistance_ohm(design)


def standing_gain(design: Design) -> Any:
    """Motor torque at rest per unit of what the controllers in front set: A, or V without a current loop."""
    motor = design.effective_motor
    if motor.source_gain_Nm_V is not None:
        return motor.source_gain_Nm_V
    R, kM, _ = _winding(motor)
    return kM if design.controller.current is not None else kM / R


def own_drag_Nms_rad(design: Design) -> Any:
    """Damping of the motor by itself: its friction and, without a current loop, its back-EMF ``kM kE/R``."""
    drag = design.friction.viscous_Nms_rad
    if not design.motor.has_electrical_dynamics or design.controller.current is not None:
        return drag
    return drag + standing_gain(design) * _winding(design.effective_motor)[2]


def _winding(motor: Motor) -> tuple[Any, Any, Any]:
    R, kM, kE = motor.resistance_ohm, motor.torque_constant_Nm_A, motor.back_emf_constant_Vs_rad
    assert R is not None
    assert kM is not None
    assert kE is not None
    return R, kM, kE
