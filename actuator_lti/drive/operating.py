"""The operating point about which a drive is made linear: friction, contact, load, direction, angle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import pi
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from actuator_lti.errors import InputError, finite_number
from actuator_lti.start.public_arguments import asked

if TYPE_CHECKING:
    from actuator_lti.design.model import Design, FrictionPoint

OperatingPoint = Literal["sliding", "rest", "describing-function", "driving", "driven", "gap"]
RotorState = Literal["free", "locked"]
CONTACT = {"driving": 1.0, "driven": -1.0, "sliding": 1.0}  # sgn(w T_s) of the load-dependent friction


@asked
@dataclass(frozen=True, kw_only=True)
class Operating:
    """Where a drive stands when it is made linear (model.md sections 3 and 6)."""

    # sliding: the viscous slope, dry friction is a constant. rest: plus Tc/w_s. describing-function: for a
    # sinusoidal speed. driving, driven (with a coupling): sliding, its torque against (as in sliding) or with
    # the motion, the sign of the load-dependent friction. gap: the coupling open, k = c = 0
    point: OperatingPoint = "sliding"
    load_Nm: float = 0.0  # at the output shaft; enters through Tc = C0 + CM |M_ext|, equation (9)
    speed_amplitude_rad_s: float | None = None  # W (peak, motor side), for the describing function
    direction: int = 1  # of motion, 1 or -1, for asymmetric friction
    rotor: RotorState = "free"
    speed_rad_s: float = 0.0  # of the motor, at which the slope of a friction map is taken
    angle_rad: float = 0.0  # of the output, at which torques that bend with the angle are made linear
    twist_rad: float = 0.0  # of the coupling: where a spring that bends stands; 0: that under ``load_Nm``
    torques_held: bool = False  # whether torques that depend on the angle are taken without their slopes
    torques_at_once: bool = False  # whether they act at every instant, not held over a tick (section 11)

    def __post_init__(self) -> None:
        if self.direction not in (1, -1):
            raise InputError(f"direction = {self.direction!r}: 1 or -1")
        for name in ("load_Nm", "speed_rad_s", "angle_rad", "twist_rad"):
            finite_number(name, getattr(self, name))
        W, allowed = self.speed_amplitude_rad_s, "positive, in rad/s (motor side)"
        needed = self.point == "describing-function"
        if needed or W is not None:
            finite_number("speed_amplitude_rad_s", W, allowed, lambda number: number > 0.0)
        if W is not None and not needed:
            at = f"operating_point = {self.point!r}"
            raise InputError(f"speed_amplitude_rad_s = {W}: {at} has none; allowed: with describing-function")

    def checked(self, design: Design) -> Operating:
        """The same, refused where the design has no such operating point."""
        if self.point in ("driving", "driven", "gap"):
            if design.coupling is None:
                raise InputError(f"operating_point = {self.point!r}: the design has no coupling")
            if self.point == "gap" and not np.any(design.coupling.play_rad):
                raise InputError("operating_point = 'gap': the coupling has no play")
        if self.rotor == "locked" and not design.motor.has_electrical_dynamics:
            raise InputError("rotor = 'locked': the design has no current, its torque is an ideal source")
        return self


def slope_at(design: Design, at: Operating) -> Any:
    """Slope of the motor's friction torque over speed, in N m s/rad (motor side).

    ``sliding``: Cv, or the slope of the friction map at a speed. ``rest``: plus Tc/w_s. Describing function:
    Cv + 4 Tc/(pi W), exact for the fundamental; where friction differs by direction, the mean of both; of a
    map exact as well, every bend being a dead zone. A float, or an array for stacked designs.
    """
    if at.point == "describing-function":
        return sum(_described(design, at, way) for way in (1, -1)) / 2
    (_, slope), *others = friction_slopes(design, at.direction)
    for start, following in others:
        slope = np.where(start <= abs(at.speed_rad_s), following, slope)[()]
    if at.point == "rest":
        slope = slope + dry_torque(design, at.load_Nm, at.direction) / design.friction.smoothing_speed_rad_s
    return slope


def dry_torque(design: Design, load_Nm: float, direction: int) -> Any:
    """Tc = C0 + CM |M_ext| in N m at the motor; C0 is the first torque of a friction map."""
    if points := design.friction.map(direction):
        return points[0].torque_Nm + design.friction.load_coefficient * abs(load_Nm)
    return design.friction.dry_Nm(load_Nm, direction)


def train_gain(design: Design, share: Any = 1.0) -> Any:
    """Motor torque per torque at the coupling: what the train passes, and so much of its friction by load."""
    passed = 1 / design.ratio_to_coupling if design.load.path == "back-drivable" else 0.0
    return passed + share * design.friction.load_coefficient * design.ratio_behind_coupling


def reaction(design: Design, at: Operating) -> Any:
    """Share of the coupling's torque that the motor feels: 1/N_c (back-drivable) + CM' sgn(w T_s)."""
    return train_gain(design, CONTACT.get(at.point, 0.0))


def rubs(design: Design) -> bool:
    """Whether there is dry friction without load, either way; of a friction map its first torque."""
    return any(dry_torque(design, 0.0, way) > 0.0 for way in (1, -1))


def segments(points: tuple[FrictionPoint, ...]) -> list[tuple[float, float]]:
    """(speed from which it holds, slope) of each straight piece of a friction map; the last continues."""
    result = [
        (a.speed_rad_s, (b.torque_Nm - a.torque_Nm) / (b.speed_rad_s - a.speed_rad_s))
        for a, b in pairwise(points)
    ]
    return result or [(0.0, 0.0)]


def friction_slopes(design: Design, direction: int) -> list[tuple[float, Any]]:
    """(speed from which it holds, slope) of each piece of the motor's friction that grows with the speed."""
    points = design.friction.map(direction)
    return [*segments(points)] if points else [(0.0, design.friction.viscous(direction))]


def _described(design: Design, at: Operating, way: int) -> Any:
    W = at.speed_amplitude_rad_s
    assert W is not None
    total, last = described_dry(dry_torque(design, at.load_Nm, way), W), 0.0
    for start, slope in friction_slopes(design, way):
        total, last = total + (slope - last) * dead_zone(start / W), slope
    return total


def described_dry(dry_Nm: Any, speed_amplitude_rad_s: Any) -> Any:
    """Slope that dry friction has for a sinusoidal speed, 4 Tc/(pi W)."""
    return 4 * dry_Nm / (pi * speed_amplitude_rad_s)


def dead_zone(x: float) -> float:
    """Describing function of a dead zone of half width x times the amplitude (model.md section 9).

    >>> dead_zone(0.0), dead_zone(1.0), round(dead_zone(0.5), 6)
    (1.0, 0.0, 0.391002)
    """
    return 0.0 if x >= 1 else 1.0 - 2.0 / pi * float(np.arcsin(x) + x * np.sqrt(1 - x * x))


def follows_angle(design: Design) -> bool:
    """Whether the drive feels a torque that changes with the angle: no constant speed is a steady motion."""
    felt = design.load.path == "back-drivable" or design.friction.load_coefficient > 0.0
    load = design.load.over_angle.follows and (felt or design.coupling is not None)
    return load or design.motor.over_angle.follows


def holding_moment_Nm(design: Design, angle_rad: float = 0.0) -> float:
    """Moment on the output shaft that holds the load's own one at an output angle."""
    return -float(design.load.over_angle.at(angle_rad))


def carried_Nm(design: Design, at: Operating) -> Any:
    """Torque of the coupling under a load and the load's own torque at the output angle, no friction."""
    own = design.load.over_angle.at(at.angle_rad, moving=_moving(design, at))
    return -(at.load_Nm + own) / design.ratio_behind_coupling


def stiffness_there(design: Design, at: Operating) -> Any:
    """Stiffness of the coupling's piece on which a drive stands: that of its twist, or of what it carries."""
    coupling = design.coupling
    assert coupling is not None
    if len(coupling.pieces) == 1:
        return coupling.stiffness_Nm_rad
    return coupling.stiffness_at(at.twist_rad or coupling.twist_rad(carried_Nm(design, at)))


def holding_torque_Nm(design: Design, angle_rad: float = 0.0, twist_rad: float = 0.0) -> float:
    """Torque at the motor that holds its own one, at an output angle and a twist of the coupling."""
    return -float(design.motor.over_angle.at(_motor_angle_rad(design, angle_rad, twist_rad)))


def _motor_angle_rad(design: Design, angle_rad: float, twist_rad: float) -> Any:
    return design.total_ratio * angle_rad + design.ratio_to_coupling * twist_rad


def runs(design: Design) -> bool:
    """Whether nothing but the speed is held: such a drive is one in motion."""
    return design.controller.outermost == "velocity"


def averaged(design: Design) -> Design:
    """The same drive without what a motion averages, cogging and gear error, if it is one in motion."""
    load = replace(design.load, gear_error_Nm=0.0)
    return replace(design, motor=design.motor.straight(), load=load) if runs(design) else design


IN_MOTION = "in motion"


def turned(design: Design) -> Iterator[tuple[str, Design]]:
    """The drive where cogging and gear error are steepest, margins extreme, and in a motion that averages."""
    motor, load = design.motor, design.load
    waves = {"cogging": motor.cogging_Nm, "gear error": load.gear_error_Nm}
    acting = " and ".join(name for name, peak_Nm in waves.items() if peak_Nm)
    if runs(design) or not acting:
        return
    for where, phase in (("on a crest", 0.0), ("in a notch", pi)):
        motor, load = replace(motor, cogging_phase_rad=phase), replace(load, gear_error_phase_rad=phase)
        yield f"{where} of the {acting}", replace(design, motor=motor, load=load)
    yield IN_MOTION, replace(design, motor=motor.straight(), load=replace(load, gear_error_Nm=0.0))


def _moving(design: Design, at: Operating) -> bool:
    return at.speed_rad_s != 0.0 or (runs(design) and at.point != "rest")


def torque_slope(design: Design, at: Operating) -> Any:
    """dT/d(motor angle) of the motor's own torque, in the same way."""
    angle = _motor_angle_rad(design, at.angle_rad, at.twist_rad)
    return 0.0 if at.torques_held else design.motor.over_angle.slope_at(angle, moving=_moving(design, at))


def moment_slope(design: Design, at: Operating) -> Any:
    """dM_ext/d(output angle) in N m/rad at the operating point; a float, or an array of stacked designs."""
    slope_at = design.load.over_angle.slope_at
    return 0.0 if at.torques_held else slope_at(at.angle_rad, moving=_moving(design, at))


def pushes_away(design: Design, at: Operating) -> Any:
    """Whether a torque grows with its deflection, or friction falls with the speed; of stacks an array."""
    return (moment_slope(design, at) > 0) | (torque_slope(design, at) > 0) | (slope_at(design, at) < 0)


def level(design: Design) -> Design:
    return replace(design, motor=design.motor.straight(), load=design.load.level())


def straight(design: Design) -> Design:
    return replace(design, motor=design.motor.straight(), load=design.load.straight())
