"""What the drive does at rest: torque against position error, and the command that breaks it away at once."""

from __future__ import annotations

import math
from dataclasses import dataclass

from actuator_lti.design.model import Design


@dataclass(frozen=True)
class StaticThreshold:
    """Smallest step that moves the output at once, by the proportional parts of the controllers.

    Attributes
    ----------
    load_Nm : float
    torque_gain_Nm_rad : float
        Motor torque per position error at the output, rotor at rest, before any integrator has acted.
    forward_rad, backward_rad : float
        Command (peak, output side) that overcomes breakaway in each direction; 0 where the load already
        does, ``inf`` where the drive is not strong enough.
    integral_time_s : float or None
        Integral time of the velocity controller: with it any smaller command moves the output later, see
        `waiting_time_s`; ``None`` where nothing integrates and the threshold is final.
    """

    load_Nm: float
    torque_gain_Nm_rad: float
    forward_rad: float
    backward_rad: float
    integral_time_s: float | None

    @property
    def smallest_rad(self) -> float:
        """The smaller of both directions."""
        return min(self.forward_rad, self.backward_rad)

    def waiting_time_s(self, amplitude_rad: float) -> float:
        """Time until a forward step moves the output: ``Tn (A0/A - 1)``; ``inf`` where it never does."""
        if amplitude_rad >= self.forward_rad:
            return 0.0
        if self.integral_time_s is None or amplitude_rad <= 0.0 or math.isinf(self.forward_rad):
            return math.inf
        return self.integral_time_s * (self.forward_rad / amplitude_rad - 1.0)


def torque_gain_Nm_rad(design: Design) -> float:
    """Motor torque per position error at the output: rotor at rest, current settled, no speed integral."""
    control, motor = design.controller, design.motor
    gain = control.position_loop.gain * design.total_ratio
    if control.velocity is not None:
        gain *= control.velocity.gain
    if motor.source_gain_Nm_V is not None:
        return gain * motor.source_gain_Nm_V
    assert motor.torque_constant_Nm_A is not None
    assert motor.resistance_ohm is not None
    if control.current is None:
        return gain * motor.torque_constant_Nm_A / motor.resistance_ohm
    gain *= motor.torque_constant_Nm_A
    if control.current.integral_time_s is None:
        gain *= control.current.gain_V_A / (control.current.gain_V_A + motor.resistance_ohm)
    return gain


def stall_torque_Nm(design: Design) -> float:
    """Largest motor torque at rest; ``inf`` without a limit."""
    motor, limits = design.motor, design.limits
    if motor.source_gain_Nm_V is not None:
        return motor.source_gain_Nm_V * limits.voltage_V
    assert motor.torque_constant_Nm_A is not None
    assert motor.resistance_ohm is not None
    current = limits.voltage_V / motor.resistance_ohm
    if design.controller.current is not None:
        current = min(current, limits.peak_current_A)
    return motor.torque_constant_Nm_A * current


def breakaway_torque_Nm(design: Design, load_Nm: float, direction: int) -> float:
    """Motor torque that starts motion in a direction; 0 where the load already does."""
    friction = design.friction
    ratio = friction.breakaway_ratio if friction.law == "coulomb" else 0.0
    needed = friction.dry_Nm(load_Nm, direction) * ratio + direction * friction.offset_torque_Nm
    if design.load.path == "back-drivable":
        needed -= direction * load_Nm / design.total_ratio
    return max(needed, 0.0)


def static_threshold(design: Design, load_Nm: float = 0.0) -> StaticThreshold:
    """Find the smallest command that moves the output at once.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> found = static_threshold(load_design("emps"))
    >>> round(1e6 * found.backward_rad, 3)  # um: (Fc - |offset|) and (Fc + |offset|) over the stiffness
    17.187
    """
    gain, strongest = torque_gain_Nm_rad(design), stall_torque_Nm(design)
    both = {}
    for direction in (1, -1):
        needed = breakaway_torque_Nm(design, load_Nm, direction)
        both[direction] = needed / gain if needed < strongest else math.inf
    velocity = design.controller.velocity
    integral = velocity.integral_time_s if velocity is not None else None
    return StaticThreshold(load_Nm, gain, both[1], both[-1], integral)
