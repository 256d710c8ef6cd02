"""What a drive feels that depends on its angle: whether there is any, what holds it, its slope.

Nothing else asks which effects these are: load and motor say it of themselves (`OverAngle`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from actuator_lti.drive.operating import slope_at

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from actuator_lti.drive.operating import Operating


def follows_angle(design: Design) -> bool:
    """Whether the drive feels a torque that changes with the angle: no constant speed is a steady motion."""
    felt = design.load.path == "back-drivable" or design.friction.load_coefficient > 0.0
    load = design.load.over_angle.follows and (felt or design.coupling is not None)
    return load or design.motor.over_angle.follows


def holding_moment_Nm(design: Design, angle_rad: float = 0.0) -> float:
    """Moment on the output shaft that holds the load's own one at an output angle."""
    return -float(design.load.over_angle.at(angle_rad))


def holding_torque_Nm(design: Design, angle_rad: float = 0.0, twist_rad: float = 0.0) -> float:
    """Torque at the motor that holds its own one, at an output angle and a twist of the coupling."""
    return -float(design.motor.over_angle.at(_motor_angle_rad(design, angle_rad, twist_rad)))


def _motor_angle_rad(design: Design, angle_rad: float, twist_rad: float) -> Any:
    return design.total_ratio * angle_rad + design.ratio_to_coupling * twist_rad


def torque_slope(design: Design, at: Operating) -> Any:
    """dT/d(motor angle) of the motor's own torque, in the same way."""
    if at.torques_held:
        return 0.0
    angle = _motor_angle_rad(design, at.angle_rad, at.twist_rad)
    return design.motor.over_angle.slope_at(angle, moving=at.speed_rad_s != 0.0)


def moment_slope(design: Design, at: Operating) -> Any:
    """dM_ext/d(output angle) in N m/rad at the operating point; a float, or an array of stacked designs."""
    if at.torques_held:
        return 0.0
    return design.load.over_angle.slope_at(at.angle_rad, moving=at.speed_rad_s != 0.0)


def pushes_away(design: Design, at: Operating) -> Any:
    """Whether a torque grows with the deflection that it makes, or friction falls with the speed.

    A bool, or an array of stacked designs.
    """
    return (moment_slope(design, at) > 0) | (torque_slope(design, at) > 0) | (slope_at(design, at) < 0)


def level(design: Design) -> Design:
    """The same drive without what changes with the angle."""
    return replace(design, motor=design.motor.level(), load=design.load.level())


def straight(design: Design) -> Design:
    """The same drive without what bends with the angle."""
    return replace(design, motor=design.motor.straight(), load=design.load.straight())
