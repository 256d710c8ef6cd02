"""Constant speed under a test: the motion on which dry friction is a constant torque (model.md section 4).

Where the friction depends on the torque of an elastic coupling, or the coupling has play, a constant moment
at the output keeps the coupling pressed, so that the drive stays on one side of it.  A drive that
feels a torque that changes with the angle has no such motion: it stands, without dry friction, and constant
moments hold it.
"""

from dataclasses import dataclass, replace
from math import copysign, cosh, inf, isfinite

import numpy as np

from actuator_lti.design.model import Command, Coupling, Design, Friction, Instruments, LoadFriction, Sensor
from actuator_lti.design.plant import reachable_speed
from actuator_lti.drive import operating
from actuator_lti.drive.facts import passed_moment_Nm, slopes_torque, stall_torque_Nm
from actuator_lti.drive.operating import Operating, follows_angle, holding_moment_Nm, holding_torque_Nm
from actuator_lti.drive.steady import motor_torque_Nm, steady_input
from actuator_lti.errors import InputError
from nonlinear.bench.steady_control import commands_fit
from nonlinear.rows import Rows

SHARE = 0.4  # of each limit that the operating motion may take
MOST = 0.8  # where friction leaves no less
FASTEST_RAD_S = 1e6
SLOWEST = 1e-9  # of that
ROOM = 0.7  # of the way to standstill, or to the next bend of a friction map, that a test may use
PRESSED = (0.15, 0.05, 0.015, 0.005)  # of the full torque: what presses the coupling
CLOSED = 0.01  # of the play: a coupling is pressed past it by as much, or rounding shows
FLAT = 1e-12  # of Tc/w_s: a smaller slope of the tanh law is none


@dataclass(frozen=True)
class OperatingMotion:
    """A drive at constant speed: every signal of the cascade, motor side."""

    speed_rad_s: float  # 0: the drive stands, and dry friction has to be left out of the test
    current_A: float  # what the motor takes; zero for an ideal torque source
    voltage_V: float
    friction_on: bool  # whether dry friction and offset torque take part
    load_Nm: float = 0.0  # constant moment at the output
    twist_rad: float = 0.0  # of the coupling, at its own shaft, as its torque; 0 where there is none
    coupling_Nm: float = 0.0
    room_rad_s: float = inf  # how far the motor speed may move before the friction is another
    # constant torque at the motor shaft: against what presses the coupling past its play, and on a drive that
    # stands against its own
    extra_Nm: float = 0.0

    def load(self, rows: Rows) -> None:
        """Write the constant moment and torque of the operating motion into rows."""
        rows["load"] = self.load_Nm
        if self.extra_Nm:
            rows["torque_table"], rows["torque_table_length"] = rows.tables.add(np.array([self.extra_Nm]))

    def output_rad(self, design: Design) -> float:
        """Output angle where the motor is at zero, which is where a drive stands."""
        return -self.twist_rad / design.ratio_behind_coupling

    def operating(self, design: Design) -> Operating:
        """Where the linear loops have to be taken to be those of this motion."""
        if design.coupling is not None and self.friction_on:
            return Operating(point="driving", speed_rad_s=self.speed_rad_s, twist_rad=self.twist_rad)
        # untold, the twist has to follow from the load: only cogging has to know how far it turns the motor
        twist = self.twist_rad if design.motor.over_angle.follows else 0.0
        load, angle = self.load_Nm, self.output_rad(design)
        return Operating(load_Nm=load, speed_rad_s=self.speed_rad_s, angle_rad=angle, twist_rad=twist)


def operating_motion(design: Design) -> OperatingMotion:
    """Choose a constant speed that leaves room to every limit and stays far from reversal.

    The speed takes at most `SHARE` of the speed limit, the voltage, the peak and the continuous current.
    Where friction alone takes more than that, the drive stands, without it.

    Raises `InputError`: if friction holds the drive whatever it does, or takes too much of a drive that
    cannot stand.

    >>> from actuator_lti.design import load_design
    >>> result = operating_motion(load_design("ilr33-amber"))
    >>> result.speed_rad_s > 100.0, result.voltage_V < 0.5 * 12.0
    (True, True)
    """
    if follows_angle(design):
        return standing(design)
    loads = [0.0]
    if needs_press(design):
        passed = 1.0 if design.load.path == "back-drivable" else 0.0
        felt = max(passed + design.friction.load_coefficient * design.total_ratio, 1e-12)
        whole = stall_torque_Nm(design) * design.total_ratio / felt  # by the motor torque that it costs
        loads = [-part * whole for part in PRESSED]
    for share in (SHARE, MOST):
        for moment in loads:
            motion = _fastest(design, moment, share)
            if motion is not None:
                return _closed(design, motion)
    least, limits = operating_motion_at(design, SLOWEST * FASTEST_RAD_S, loads[-1]), design.limits
    stuck = least.voltage_V > limits.voltage_V or least.current_A > limits.peak_current_A
    if stuck or not may_stand(design):
        part = f"{100 if stuck else 100 * MOST:.0f} % of the current or voltage limit"
        message = f"friction takes more than {part}: no steady motion to test on"
        raise InputError(message, where=design.name)
    return standing(design)


def needs_press(design: Design) -> bool:
    """Whether a coupling has to be kept on one side: it has play, or its torque makes friction."""
    coupling = design.coupling
    return coupling is not None and (coupling.play_rad > 0.0 or design.friction.load_coefficient > 0.0)


def may_stand(design: Design) -> bool:
    """Whether the drive has one slope about rest, of play and friction, once its dry friction is left out."""
    return follows_angle(design) or not (is_uneven(design.friction) or needs_press(design))


def is_uneven(friction: Friction) -> bool:
    """Whether its slope differs by speed or direction, so that a drive at rest has not one."""
    return bool(friction.points) or friction.viscous(1) != friction.viscous(-1)


def creeping(design: Design, *, driven: bool = False) -> OperatingMotion:
    """Forward so slowly that no torque over an angle changes: every friction slides on its first slope.

    A load against the motion, or with it (``driven``), keeps a coupling on the first piece of its spring. A
    torque at the motor shaft carries all: no controller needs an error for it.
    """
    pressed, coupling = 0.0, design.coupling
    if coupling is not None:
        pressed = min(PRESSED[0] * stall_torque_Nm(design) * design.ratio_to_coupling, _piece_Nm(coupling))
        pressed *= design.ratio_behind_coupling * (1.0 if driven else -1.0)
    motion = operating_motion_at(design, SLOWEST * FASTEST_RAD_S, pressed)
    current, voltage = steady_input(design, 0.0, motion.speed_rad_s)
    torque = motor_torque_Nm(design, motion.current_A - current, motion.voltage_V - voltage)
    angle = motion.output_rad(design)
    torque += holding_torque_Nm(design, angle, motion.twist_rad)
    load_Nm = pressed + holding_moment_Nm(design, angle)
    return replace(motion, current_A=current, voltage_V=voltage, load_Nm=load_Nm, extra_Nm=torque)


def on_its_stand(design: Design, like: Design | None = None) -> Design:
    """A drive without friction that would give it two slopes where it is tested; others as they are.

    One in motion feels no cogging. One that has to stand knows no friction by direction; a rigid one none by
    load, which has two slopes at no load and is no part of its loops.  ``like`` is the drive that is tested,
    if another.
    """
    design, tested = operating.averaged(design), operating.averaged(like or design)
    friction = design.friction
    if follows_angle(tested):
        friction = replace(friction, load_coefficient=0.0, points=(), viscous_reverse_Nms_rad=None)
    elif tested.coupling is None:
        friction = replace(friction, load_coefficient=0.0)
    return design if friction == design.friction else replace(design, friction=friction)


def standing(design: Design) -> OperatingMotion:
    """At rest, motor at zero, no dry friction: a constant torque there holds it, and a constant moment.

    A coupling carries the load's own torque at output angle 0; one with play is pressed where that does not
    close it.  The drive is one that `may_stand`, `on_its_stand`.
    """
    coupling, torque, carried = design.coupling, holding_torque_Nm(design), holding_moment_Nm(design)
    if coupling is None:
        return OperatingMotion(0.0, 0.0, 0.0, False, carried, extra_Nm=torque)
    coupling_Nm = carried / design.ratio_behind_coupling
    if coupling.play_rad > 0.0 and abs(coupling_Nm) < _closing_Nm(coupling):
        press = PRESSED[0] * stall_torque_Nm(design) * design.ratio_to_coupling
        coupling_Nm = max(press, _closing_Nm(coupling))
    twist = coupling.twist_rad(coupling_Nm)
    torque += passed_moment_Nm(design, coupling_Nm * design.ratio_behind_coupling)
    moment = holding_moment_Nm(design, -twist / design.ratio_behind_coupling)
    moment -= coupling_Nm * design.ratio_behind_coupling
    return OperatingMotion(0.0, 0.0, 0.0, False, moment, twist, coupling_Nm, extra_Nm=torque)


def _closing_Nm(coupling: Coupling) -> float:
    """What presses a coupling past its play, on its first piece."""
    return min(CLOSED * coupling.play_rad * coupling.stiffness_Nm_rad, _piece_Nm(coupling))


def _piece_Nm(coupling: Coupling) -> float:
    """Half the torque of the first piece of a spring that bends."""
    return inf if coupling.torque_1_Nm is None else 0.5 * coupling.torque_1_Nm


def _closed(design: Design, motion: OperatingMotion) -> OperatingMotion:
    """The same with the coupling pressed past its play; a torque at the motor shaft carries what it takes."""
    coupling, pressed = design.coupling, motion.coupling_Nm
    if coupling is None or abs(pressed) >= _closing_Nm(coupling):
        return motion
    more = copysign(_closing_Nm(coupling), pressed) - pressed
    load_Nm = motion.load_Nm - more * design.ratio_behind_coupling
    held = operating_motion_at(design, motion.speed_rad_s, load_Nm)
    extra = motor_torque_Nm(design, held.current_A - motion.current_A, held.voltage_V - motion.voltage_V)
    twist, torque = held.twist_rad, held.coupling_Nm
    return replace(motion, load_Nm=load_Nm, twist_rad=twist, coupling_Nm=torque, extra_Nm=extra)


def _fastest(design: Design, load_Nm: float, share: float) -> OperatingMotion | None:
    """The fastest motion within the limits; None where there is none."""
    limits = design.limits
    top = reachable_speed(design)
    speed = SHARE * top if isfinite(top) else FASTEST_RAD_S
    current = share * min(limits.peak_current_A, limits.continuous_current_A)
    while speed > SLOWEST * FASTEST_RAD_S:
        motion = operating_motion_at(design, speed, load_Nm)
        fits = motion.voltage_V <= share * limits.voltage_V and abs(motion.current_A) <= current
        if fits and commands_fit(design, motion) and motion.room_rad_s > 0.0:
            return motion
        speed *= 0.8
    return None


def operating_motion_at(design: Design, speed_rad_s: float, load_Nm: float = 0.0) -> OperatingMotion:
    """The steady state at a motor speed (rad/s, either direction) under a moment at the output."""
    friction, moment, sense = design.friction, load_Nm, int(copysign(1.0, speed_rad_s))
    moment -= design.load.moment_damping_Nms_rad * speed_rad_s / design.total_ratio
    passed = 1.0 if design.load.path == "back-drivable" else 0.0
    twist = coupling_Nm = 0.0
    if design.coupling is None:
        torque = sense * friction.load_coefficient * abs(moment) - passed_moment_Nm(design, moment)
    else:
        coupling_Nm = _behind(design.load.friction, speed_rad_s / design.ratio_to_coupling)
        coupling_Nm -= moment / design.ratio_behind_coupling
        twist = design.coupling.twist_rad(coupling_Nm)
        torque = passed * coupling_Nm / design.ratio_to_coupling
        torque += sense * friction.load_coefficient * design.ratio_behind_coupling * abs(coupling_Nm)
    slopes = operating.friction_slopes(design, sense)
    own = operating.dry_torque(design, 0.0, sense) + slopes_torque(slopes, abs(speed_rad_s))
    torque += sense * float(own) + friction.offset_torque_Nm
    room = _room(friction, abs(speed_rad_s), sense)
    current, voltage = steady_input(design, torque, speed_rad_s)
    return OperatingMotion(speed_rad_s, current, voltage, True, load_Nm, twist, coupling_Nm, room)


def _behind(friction: LoadFriction | None, speed_rad_s: float) -> float:
    """Friction of the load at its own shaft."""
    if friction is None:
        return 0.0
    dry = copysign(friction.dry_torque_Nm, speed_rad_s)
    return dry + friction.viscous_Nms_rad * speed_rad_s + friction.offset_torque_Nm


def _room(friction: Friction, speed_rad_s: float, sense: int) -> float:
    """How far the speed may move: part of the way to rest, to a bend of the map, to the slope of a tanh."""
    if friction.law == "tanh" and friction.dry_Nm(0.0, sense) > 0.0:
        least = friction.smoothing_speed_rad_s * 14.0  # there the slope of tanh is below FLAT
        x = speed_rad_s / friction.smoothing_speed_rad_s
        flat = x > 300.0 or cosh(x) ** -2 < FLAT
        return min(ROOM * speed_rad_s, speed_rad_s - least) if flat else 0.0
    bends = [start for start, _ in operating.segments(friction.map(sense))] if friction.points else []
    return ROOM * min(abs(speed_rad_s - bend) for bend in (0.0, *bends))


def on_the_bench(design: Design) -> Design:
    """A drive as its loops are tested: ideal instruments, and the command taken as it is."""
    return replace(quiet(design), command=Command())


def quiet(design: Design) -> Design:
    """A drive without counts and noise: what they keep moving is a finding of its own."""
    return replace(without_counts(design), instruments=Instruments())


def without_counts(design: Design, *sensors: Sensor) -> Design:
    """The same drive with some encoders free of counts, by default with both."""
    if "motor" in sensors or not sensors:
        design = replace(design, encoder=replace(design.encoder, counts_per_rev=None))
    if "output" in sensors or not sensors:
        design = replace(design, output_encoder=replace(design.output_encoder, counts_per_rev=None))
    return design
