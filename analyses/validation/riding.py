"""Constant speed under a test: the motion on which dry friction is a constant torque (model.md section 4).

Where the friction depends on the torque of an elastic coupling, or the coupling has play, a constant moment
at the output keeps the coupling pressed, so that the drive stays on one side of it.  A drive whose load
changes with the angle cannot ride: it stands, without dry friction, and a constant moment holds gravity.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cosh, inf, isfinite

from actuator_lti.design.model import Design, Friction, LoadFriction
from actuator_lti.drive.operating import Operating, segments
from actuator_lti.errors import InputError

SHARE = 0.4  # of each limit that riding may take
FASTEST_RAD_S = 1e6
SLOWEST = 1e-9  # of that
ROOM = 0.7  # of the way to standstill, or to the next bend of a friction map, that a test may use
PRESSED = (0.15, 0.05, 0.015, 0.005)  # of the full torque: what presses the coupling
FLAT = 1e-12  # of Tc/w_s: a smaller slope of the tanh law is none


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
    load_Nm : float
        Constant moment at the output.
    twist_rad, coupling_Nm : float
        Of the coupling, at its own shaft; 0 where the drive train is rigid.
    room_rad_s : float
        How far the motor speed may move before the friction is another.
    """

    speed_rad_s: float
    current_A: float
    voltage_V: float
    friction_on: bool
    load_Nm: float = 0.0
    twist_rad: float = 0.0
    coupling_Nm: float = 0.0
    room_rad_s: float = inf

    def operating(self, design: Design) -> Operating:
        """Where the linear loops have to be taken to be those of this ride."""
        point = "driving" if design.coupling is not None and self.friction_on else "sliding"
        return Operating(point=point, speed_rad_s=self.speed_rad_s)


def ride(design: Design, load_Nm: float = 0.0) -> Ride:
    """Choose a constant speed that leaves room to every limit and stays far from reversal.

    The speed takes at most `SHARE` of the speed limit, the voltage, the peak and the continuous current.
    Where friction alone takes more than that, the drive stands, without it.

    Raises
    ------
    InputError
        If friction holds the drive whatever it does, or a drive that has to stand has a slope of its own about
        rest.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> found = ride(load_design("ilr33-amber"))
    >>> found.speed_rad_s > 100.0, found.voltage_V < 0.5 * 12.0
    (True, True)
    """
    if has_to_stand(design):
        return standing(design)
    loads = [load_Nm]
    if needs_press(design):
        whole = full_torque_Nm(design) * design.total_ratio / _felt(design)
        loads = [load_Nm - part * whole for part in PRESSED]
    for moment in loads:
        found = _fastest(design, moment)
        if found is not None:
            return found
    least, limits = riding_at(design, SLOWEST * FASTEST_RAD_S, loads[-1]), design.limits
    stuck = least.voltage_V > limits.voltage_V or least.current_A > limits.peak_current_A
    if stuck or bent_about_rest(design):
        message = f"friction takes more than {1.0 if stuck else SHARE:.0%} of the current or voltage limit"
        raise InputError(f"{message}: no steady motion to test on", where=design.name)
    return standing(design)


def needs_press(design: Design) -> bool:
    """Whether a coupling has to be kept on one side: it has play, or its torque makes friction."""
    coupling = design.coupling
    return coupling is not None and (coupling.play_rad > 0.0 or design.friction.load_coefficient > 0.0)


def has_to_stand(design: Design) -> bool:
    """Whether the load changes with the angle, in a way that the motor feels."""
    load = design.load
    changes = load.moment_slope_Nm_rad != 0.0 or load.gravity is not None
    felt = load.path == "back-drivable" or design.friction.load_coefficient > 0.0
    return changes and (felt or design.coupling is not None)


def bent_about_rest(design: Design) -> bool:
    """Whether play or friction gives a drive at rest another slope than a moving one has."""
    friction = design.friction
    uneven = bool(friction.points) or friction.viscous(1) != friction.viscous(-1)
    return uneven or needs_press(design)


def standing(design: Design) -> Ride:
    """At rest at zero without dry friction, a constant moment against gravity.

    Raises
    ------
    InputError
        If the drive has a slope of its own about rest.
    """
    if bent_about_rest(design):
        message = "a load that changes with the angle, and play, friction of the coupling's torque, a friction"
        raise InputError(
            f"{message} map or one that differs by direction: no motion on which the drive is linear",
            where=design.name,
        )
    gravity = design.load.gravity
    return Ride(0.0, 0.0, 0.0, False, load_Nm=0.0 if gravity is None else -gravity.moment_Nm(0.0))


def full_torque_Nm(design: Design) -> float:
    """Torque that the motor reaches at its limits, at standstill."""
    motor, limits = design.effective_motor, design.limits
    if motor.source_gain_Nm_V is not None:
        return motor.source_gain_Nm_V * limits.voltage_V
    short = limits.voltage_V / (motor.resistance_ohm or 1.0)
    return (motor.torque_constant_Nm_A or 0.0) * min(limits.peak_current_A, short)


def _felt(design: Design) -> float:
    """Motor torque that a moment at the output costs, times N."""
    passed = 1.0 if design.load.path == "back-drivable" else 0.0
    return max(passed + design.friction.load_coefficient * design.total_ratio, 1e-12)


def _fastest(design: Design, load_Nm: float) -> Ride | None:
    """The fastest ride within the limits; None where there is none."""
    limits = design.limits
    speed = SHARE * limits.speed_rad_s if isfinite(limits.speed_rad_s) else FASTEST_RAD_S
    current = SHARE * min(limits.peak_current_A, limits.continuous_current_A)
    while speed > SLOWEST * FASTEST_RAD_S:
        found = riding_at(design, speed, load_Nm)
        fits = found.voltage_V <= SHARE * limits.voltage_V and abs(found.current_A) <= current
        if fits and found.room_rad_s > 0.0:
            return found
        speed *= 0.8
    return None


def riding_at(design: Design, speed_rad_s: float, load_Nm: float = 0.0) -> Ride:
    """The steady state at a motor speed (rad/s, positive) under a moment at the output."""
    friction, motor = design.friction, design.effective_motor
    passed = 1.0 if design.load.path == "back-drivable" else 0.0
    twist = coupling_Nm = 0.0
    if design.coupling is None:
        torque = friction.load_coefficient * abs(load_Nm) - passed * load_Nm / design.total_ratio
    else:
        coupling_Nm = _behind(design.load.friction, speed_rad_s / design.ratio_to_coupling)
        coupling_Nm -= load_Nm / design.ratio_behind_coupling
        half = 0.5 * design.coupling.play_rad * (1.0 if coupling_Nm > 0.0 else -1.0)
        twist = coupling_Nm / design.coupling.stiffness_Nm_rad + half
        torque = passed * coupling_Nm / design.ratio_to_coupling
        torque += friction.load_coefficient * design.ratio_behind_coupling * abs(coupling_Nm)
    torque += _own(friction, speed_rad_s) + friction.offset_torque_Nm
    room = _room(friction, speed_rad_s)
    if motor.source_gain_Nm_V is not None:
        drive = (0.0, torque / motor.source_gain_Nm_V)
    else:
        assert motor.torque_constant_Nm_A is not None
        assert motor.resistance_ohm is not None
        assert motor.back_emf_constant_Vs_rad is not None
        current = torque / motor.torque_constant_Nm_A
        drive = (current, motor.resistance_ohm * current + motor.back_emf_constant_Vs_rad * speed_rad_s)
    return Ride(speed_rad_s, *drive, True, load_Nm, twist, coupling_Nm, room)


def _behind(friction: LoadFriction | None, speed_rad_s: float) -> float:
    """Friction of the load at its own shaft."""
    if friction is None:
        return 0.0
    return friction.dry_torque_Nm + friction.viscous_Nms_rad * speed_rad_s + friction.offset_torque_Nm


def _own(friction: Friction, speed_rad_s: float) -> float:
    """Dry and viscous friction of the motor, or its map, forward."""
    points = friction.map(1)
    if not points:
        return friction.dry_Nm(0.0) + friction.viscous() * speed_rad_s
    torque = points[0].torque_Nm
    pieces = segments(points)
    ends = [start for start, _ in pieces[1:]] + [inf]
    for (start, slope), end in zip(pieces, ends, strict=True):
        torque += slope * max(min(speed_rad_s, end) - start, 0.0)
    return torque


def _room(friction: Friction, speed_rad_s: float) -> float:
    """How far the speed may move: part of the way to rest, to a bend of the map, to the slope of a tanh."""
    if friction.law == "tanh" and friction.dry_Nm(0.0) > 0.0:
        least = friction.smoothing_speed_rad_s * 14.0  # there the slope of tanh is below FLAT
        return min(ROOM * speed_rad_s, speed_rad_s - least) if _flat(friction, speed_rad_s) else 0.0
    bends = [0.0, *(start for start, _ in segments(friction.map(1)))] if friction.points else [0.0]
    return ROOM * min(abs(speed_rad_s - bend) for bend in bends)


def _flat(friction: Friction, speed_rad_s: float) -> bool:
    x = speed_rad_s / friction.smoothing_speed_rad_s
    return x > 300.0 or cosh(x) ** -2 < FLAT
