"""Constant speed under a test: the motion on which dry friction is a constant torque (model.md section 4)."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError

SHARE = 0.4  # of each limit that riding may take
FASTEST_RAD_S = 1e6


@dataclass(frozen=True)
class Ride:
    """A drive at constant speed: every signal of the cascade, motor side.

    Attributes
    ----------
    speed_rad_s : float
        0: the drive stands, and dry friction has to be left out of the test.
    current_A, voltage_V : float
        What the motor takes (zero current for an ideal torque source).
    friction_on : bool
        Whether dry friction and offset torque take part.
    """

    speed_rad_s: float
    current_A: float
    voltage_V: float
    friction_on: bool


def ride(design: Design, load_Nm: float = 0.0) -> Ride:
    """Choose a constant speed that leaves room to every limit and stays far from reversal.

    The speed takes at most `SHARE` of the speed limit, the voltage and the peak current.  A drive whose
    load torque grows with the angle cannot ride at a steady torque: it stands, without dry friction.

    Raises
    ------
    InputError
        If dry friction alone takes more than that share of the current or the voltage.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> found = ride(load_design("ilr33-amber"))
    >>> found.speed_rad_s > 100.0, found.voltage_V < 0.5 * 12.0
    (True, True)
    """
    if design.load.path == "back-drivable" and design.load.moment_slope_Nm_rad != 0.0:
        return Ride(0.0, 0.0, 0.0, friction_on=False)
    limits = design.limits
    speed = SHARE * limits.speed_rad_s if isfinite(limits.speed_rad_s) else FASTEST_RAD_S
    while speed > 1e-9 * FASTEST_RAD_S:
        found = riding_at(design, speed, load_Nm)
        if found.voltage_V <= SHARE * limits.voltage_V and found.current_A <= SHARE * limits.peak_current_A:
            return found
        speed *= 0.8
    dry = design.friction.dry_Nm(load_Nm)
    message = f"dry friction of {dry:.3g} N m takes more than {SHARE:.0%} of the current or voltage limit"
    raise InputError(f"{message}: no steady motion to test on", where=design.name)


def riding_at(design: Design, speed_rad_s: float, load_Nm: float = 0.0) -> Ride:
    """The steady state at a motor speed (rad/s, positive)."""
    friction, motor = design.friction, design.motor
    torque = friction.dry_Nm(load_Nm) + friction.offset_torque_Nm + friction.viscous() * speed_rad_s
    if design.load.path == "back-drivable":
        torque -= load_Nm / design.total_ratio
    if motor.source_gain_Nm_V is not None:
        return Ride(speed_rad_s, 0.0, torque / motor.source_gain_Nm_V, friction_on=True)
    assert motor.torque_constant_Nm_A is not None
    assert motor.resistance_ohm is not None
    assert motor.back_emf_constant_Vs_rad is not None
    current = torque / motor.torque_constant_Nm_A
    voltage = motor.resistance_ohm * current + motor.back_emf_constant_Vs_rad * speed_rad_s
    return Ride(speed_rad_s, current, voltage, friction_on=True)
