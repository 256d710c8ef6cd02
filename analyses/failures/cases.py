"""The failures, and the drive that they happen on, split into its controller and its plant.

The controller is the drive's own on measured values; the plant is the same drive without its loops, a voltage
in.  Nothing failed, the two together are the drive (`nonlinear.simulate`) bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

from actuator_lti.design.control import Stage
from actuator_lti.design.model import Command, Design, Instruments, LoadFriction
from actuator_lti.drive.facts import held_moment_Nm, resonance_rad_s, stall_torque_Nm
from actuator_lti.drive.operating import runs, straight
from actuator_lti.drive.profile import profile_passes_rad_s
from actuator_lti.drive.steady import motor_torque_Nm
from actuator_lti.errors import InputError
from actuator_lti.loops import assemble_loops
from actuator_lti.types import Floats
from analyses.failures.asked import NEAR_SHARE, Asked
from analyses.large_signal.tones import full_command
from analyses.linear.loop_figures import all_loop_figures
from nonlinear import Drive, Rows, State
from nonlinear.runs.running import Piece, Running
from nonlinear.runs.trajectory import COMMAND_UNITS, followed_at

Sensing = Callable[[State], State]
Driving = Callable[[float, float], float]


def plant_of(design: Design) -> Design:
    """The drive without its loops and command shaping; its instruments stay with the controller."""
    bare = replace(design.controller, position=None, velocity=None, current=None)
    limits = replace(design.limits, peak_time_s=None)  # the overload protection is the controller's
    return replace(design, controller=bare, limits=limits, command=Command(), instruments=Instruments())


class Halves:
    """The two halves; ``sensing`` changes what the controller gets, ``driving`` the voltage by (u, U_bus)."""

    def __init__(self, design: Design, load_Nm: float) -> None:
        self.design, self.load_Nm, self.ratio = design, load_Nm, design.total_ratio
        bends = design.load.over_angle
        self.own_Nm = bends.at if bends.follows else lambda _: 0.0  # of the load over the output's angle
        self.controller, self.plant = Drive(design), Drive(plant_of(design), load_Nm=load_Nm)
        self.sensing: Sensing | None = None
        self.driving: Driving | None = None
        self.moment_Nm, self.jammed = 0.0, False

    def copy(self) -> Halves:
        """Another one in the same state, nothing failed."""
        twin = Halves(self.design, self.load_Nm)
        twin.controller.set(self.controller.get())
        twin.plant.set(self.plant.get())
        return twin

    def measured(self) -> State:
        """The truth about the plant at t_k."""
        value, rigid = self.plant.value, self.design.coupling is None
        return State(
            motor_angle_rad=value("angle"),
            motor_speed_rad_s=value("speed"),
            current_A=value("current"),
            voltage_V=value("voltage"),
            output_angle_rad=self.output_rad,
            output_speed_rad_s=value("speed") / self.ratio if rigid else value("output_speed"),
        )

    @property
    def output_rad(self) -> float:
        """Angle of the output at t_k."""
        rigid = self.design.coupling is None
        return self.plant.value("angle") / self.ratio if rigid else self.plant.value("output")

    def whole(self, command: float) -> Running:
        """The drive as one, from rest, under a command that stays: the two before a failure, bit for bit."""
        rows = Rows.of(replace(self.design, instruments=Instruments()))
        rows["load"] = self.load_Nm
        rows.step("command", command)
        return rows.running()

    def go_on_from(self, whole: Running) -> None:
        """Take over the state of the drive as one."""
        self.controller.set(whole.s)
        self.plant.set_motion(whole.s)

    def followed(self, piece: Piece) -> Floats:
        """What the command orders, at each tick: position or speed at the output, current, voltage."""
        return followed_at(self.design.controller.outermost, self.ratio, piece.signal)

    @property
    def turning(self) -> dict[str, str]:
        """Speed of the output side and energy of the motor side, in words."""
        speed, design = self.measured().motor_speed_rad_s, self.design
        energy = 0.5 * design.motor_side_inertia_kgm2 * speed**2
        return {"speed": _size(design, speed / self.ratio, "velocity"), "energy": f"{energy:.3g} J"}

    def fail(self, broken: Design) -> None:
        """Go on with another plant from the same angles, speeds, current and voltage."""
        state = self.measured()
        if not broken.motor.has_electrical_dynamics:
            state = replace(state, current_A=0.0, voltage_V=0.0)
        if self.design.coupling is None:  # no twist, and one speed
            state = replace(state, output_angle_rad=None, output_speed_rad_s=None)
        self.plant = Drive(plant_of(broken), state, self.load_Nm)

    def step(self, command: float) -> State:
        """One tick; gives the truth at its start. `moment_Nm` is what the train carried, at the output."""
        true, bus = self.measured(), self.plant.value("voltage_limit")
        seen = true if self.sensing is None else self.sensing(true)
        u = self.controller.control(
            command, seen.current_A, seen.motor_speed_rad_s, seen.motor_angle_rad,
            seen.output_angle_rad, bus, seen.output_speed_rad_s,
        )  # fmt: skip
        if self.driving is not None:
            u = self.driving(u, bus)
        self.plant.step(u)
        self.moment_Nm = self._carried_Nm(true, u)
        return true

    def _carried_Nm(self, true: State, u: float) -> float:
        """Torque of the coupling; rigid, what the output takes over the tick, or presses on a jam with."""
        design, load = self.design, self.design.load
        if design.coupling is not None:
            return self.plant.noted("coupling_torque") * design.ratio_behind_coupling
        if self.jammed:
            return held_moment_Nm(design, float(motor_torque_Nm(design, true.current_A, u)))
        N, now = self.ratio, true.motor_speed_rad_s
        faster = (self.plant.value("speed") - now) / N / design.controller.period_s
        own = float(self.own_Nm(true.motor_angle_rad / N)) - load.moment_damping_Nms_rad * now / N
        return load.inertia_kgm2 * faster - own - self.load_Nm


HELD = 1e6  # times the stall torque: no torque of the drive moves a jam

CommandOverTime = Callable[[float], float]


@dataclass(frozen=True)
class Case:
    """One failure."""

    name: str
    words: str  # with {speed} and {energy} as in `Halves.turning`
    command: CommandOverTime  # from the failure on (from the step on, where ``at_rad`` is given)
    broken: Callable[[Halves], None] = lambda _: None  # what is done to them
    start: float = 0.0  # command that the drive follows before
    at_rad: float | None = None  # when the output is this far from the start; ``None``: at once
    stops: bool = True  # whether the run ends at the stop


def cases_of(design: Design, asked: Asked) -> tuple[tuple[Case, ...], dict[str, str]]:
    """The cases that exist for a design, and why the others do not; of those of one name the worst counts."""
    open_phase = "the winding is open: no current, no torque"
    if design.motor.constants != "dc":
        more = "a DC equivalent has one winding; the pulsating torque of two phases left is not modelled"
        open_phase += f" ({more})"
    W, stage = asked.speed_rad_s, design.controller.outermost
    # Of a drive that turns either way: one overspeeds it, the other adds its back-EMF to the bus
    over, ways = "the power stage puts the whole bus on the motor", (1.0, -1.0) if W else (1.0,)
    over += ", either way" * (len(ways) > 1)
    made = (
        *(Case("hard-over", over, lambda _: W, partial(_hard_over, way=way), W) for way in ways),
        Case("open-phase", open_phase, lambda _: W, _open, W),
    )
    if stage == "voltage":
        return made, dict.fromkeys(_LOOP_CASES, "the drive has no loop")
    own = {"position": _of_position, "velocity": _of_speed, "current": _of_current}[stage](design, asked)
    there = {case.name for case in own}
    return made + own, {name: _MISSING[name] for name in _LOOP_CASES if name not in there}


_LOOP_CASES = ("hard-over-command", "jam", "frozen-sensor", "lost-sensor", "oscillatory-command")
_MISSING = {
    "frozen-sensor": "a sensor that freezes there is a lost one",
    "jam": "its command gives it no speed",
    "oscillatory-command": "nothing resonates in a rigid train",
}


def _of_position(design: Design, asked: Asked) -> tuple[Case, ...]:
    far, near, half = asked.stop_rad, asked.deflection_rad, 0.5 * asked.stop_rad
    frozen = f"the position sensor freezes, the command steps by {_size(design, near)}"
    lost = f"the position sensor reads zero while the drive holds {_size(design, half)}"
    jams = "the output jams half-way through a step to the stop"
    return (
        Case("hard-over-command", "the command jumps to the stop", lambda _: far),
        Case("jam", jams, lambda _: far, _jam, at_rad=half, stops=False),
        Case("frozen-sensor", frozen, lambda _: near, partial(_sense, zero=False)),
        Case("lost-sensor", lost, lambda _: half, partial(_sense, zero=True), start=half),
        *_swings(design, near),
    )


def _of_speed(design: Design, asked: Asked) -> tuple[Case, ...]:
    W, far = asked.speed_rad_s, full_command(design)
    over = f"the command jumps to ±{_size(design, far)}"
    turns, jams = "while the drive turns at {speed}" if W else "at rest", "the output jams "
    energy = ", {energy} in what turns before the coupling"
    if design.coupling is None:
        energy = "; the {energy} that turn are no part of this torque"
    jams += turns + energy * bool(W)
    return (
        Case("hard-over-command", over, lambda _: far, start=W),
        Case("hard-over-command", over, lambda _: -far, start=W),
        Case("jam", jams, lambda _: W, _jam, start=W, stops=False),
        Case("lost-sensor", f"the speed sensor stops counting {turns}", lambda _: W, _sense, start=W),
        *_swings(design, NEAR_SHARE * far, W),
    )


def _of_current(design: Design, asked: Asked) -> tuple[Case, ...]:
    far = full_command(design)
    near = NEAR_SHARE * far
    lost = f"the current sensor reads zero, the command steps by {_size(design, near)}"
    return (
        Case("hard-over-command", f"the command jumps to {_size(design, far)}", lambda _: far),
        Case("lost-sensor", lost, lambda _: near, _sense),
        *(_swings(design, near) if design.coupling is not None else ()),
    )


def _jam(halves: Halves) -> None:
    halves.fail(jammed(halves.design))
    halves.jammed = True


def _swings(design: Design, size: float, around: float = 0.0) -> Iterator[Case]:
    for hz, where in _sines(design, size):
        words = f"a sine of {_size(design, size)} at {hz:.4g} Hz, {where}"
        turn = 2.0 * math.pi * hz

        def command(t: float, turn: float = turn) -> float:
            return around + size * math.sin(turn * t)

        yield Case("oscillatory-command", words, command, start=around, stops=False)


def _hard_over(halves: Halves, *, way: float) -> None:
    halves.driving = lambda _, bus: way * bus


def jammed(design: Design) -> Design:
    """The drive with its output held fast: rigid, the whole train; elastic, what is behind the coupling."""
    hold = HELD * float(stall_torque_Nm(design))
    if not math.isfinite(hold):
        raise InputError("failures: a drive without a limit of voltage or current has no jam")
    if design.coupling is None:
        return replace(design, friction=replace(design.friction, law="coulomb", points=(), dry_torque_Nm=hold,
                       dry_torque_reverse_Nm=None))  # fmt: skip
    behind = design.load.friction or LoadFriction()
    held = replace(behind, dry_torque_Nm=hold * design.ratio_to_coupling)
    return replace(design, load=replace(design.load, friction=held))


def _open(halves: Halves) -> None:
    """No current flows."""
    halves.driving = lambda _, bus: 0.0
    halves.fail(
        replace(halves.design, motor=halves.design.motor.without_current, supply=None, temperature=None)
    )


def _sense(halves: Halves, *, zero: bool = False) -> None:
    """Freeze the outermost loop's sensor, or let it read zero; a speed taken from it is zero."""
    stage = halves.design.controller.outermost
    if stage == "current":
        halves.sensing = lambda true: replace(true, current_A=0.0)
        return
    sensor, part = getattr(halves.design.controller, stage).sensor, 0.0 if zero else 1.0
    angle = part * getattr(halves.measured(), f"{sensor}_angle_rad")
    halves.sensing = lambda true: replace(
        true, **{f"{sensor}_angle_rad": angle, f"{sensor}_speed_rad_s": 0.0}
    )


def _sines(design: Design, size: float) -> Iterator[tuple[float, str]]:
    """Frequencies in Hz at which the output may follow a sine of the command most, and in words which.

    Resonance and bandwidth as `margins` has them, of what turns without what passes; or the highest that the
    profile lets pass. Of a torque the resonance of motor and load.
    """
    stage = design.controller.outermost
    if stage == "current":
        yield float(resonance_rad_s(design)) / (2.0 * math.pi), "the resonance of motor and load"
        return
    loops = assemble_loops(straight(design) if runs(design) else design)
    band = all_loop_figures(loops, step=False)[stage].bandwidth
    if band is not None and band.resonance_hz:
        yield band.resonance_hz, "the resonance of its response"
    if band is not None and band.minus3db_hz is not None:
        highest, words = band.minus3db_hz, "its bandwidth"
    else:
        period = design.controller.period_of(stage)
        highest, words = 0.5 / period, "half its sampling frequency, as it has no bandwidth"
    yield highest, words
    if (passed := profile_passes_rad_s(design, size) / (2.0 * math.pi)) < highest:
        yield passed, "the highest that rate and acceleration of the command let pass"


def _size(design: Design, value: float, stage: Stage | None = None) -> str:
    unit, scale = COMMAND_UNITS[design.axis, stage or design.controller.outermost]
    return f"{float(f'{scale * value:.3g}'):g} {unit}"
