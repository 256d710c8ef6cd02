"""The stiffness of a design, the inverse of the response from M_ext to the output, and the simulator's."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import ceil, sqrt
from typing import Literal

import numpy as np
import numpy.typing as npt

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design, LoadFriction
from actuator_lti.drive.operating import Operating, OperatingPoint, stiffness_there
from actuator_lti.errors import InputError, UnstableError
from actuator_lti.loops import stiffness as linear
from analyses.large_signal.classify import STEADY
from analyses.motion.settling import settling_ticks_of
from analyses.specification.requirements import RequirementVerdict, judged_by, tally
from nonlinear import commands, simulate, tangent
from nonlinear.bench.loop_setup import HELD, LoopSetup
from nonlinear.bench.operating_motion import creeping, is_uneven, on_the_bench, standing
from nonlinear.loads import series

State = Literal["powered", "shorted", "open"]


@dataclass(frozen=True)
class StiffnessCurve:
    """Dynamic stiffness K = M_ext / output angle over frequency, in one state of the drive."""

    state: State  # loops closed, command held; unpowered, winding shorted; without a current
    frequency_hz: npt.NDArray[np.float64]
    stiffness_Nm_rad: npt.NDArray[np.complex128]  # (linear axis: N/m); inf: it does not move
    static_Nm_rad: float  # at zero frequency: below 0 it pushes away, 0 of a free one, inf if it returns
    load_Nm: float = 0.0  # at the output: which piece of a spring that bends is used
    way: OperatingPoint = "sliding"  # of friction by the coupling's torque (`actuator_lti.loops.stiffness`)

    @property
    def least(self) -> tuple[float, float]:
        """Smallest |K| and its frequency in Hz; 0 Hz where the static one is below all others."""
        size = np.abs(self.stiffness_Nm_rad)
        k = int(np.argmin(size))
        if self.static_Nm_rad < size[k]:
            return self.static_Nm_rad, 0.0
        return float(size[k]), float(self.frequency_hz[k])


@dataclass(frozen=True)
class LostMotion:
    """How far apart a small load torque moves the output, the motor held; at least the play."""

    play_rad: float  # the play of the coupling at the output
    predicted_rad: float  # at +-3 % of the largest load torque (`actuator_lti.loops.stiffness`)
    simulated_rad: float | None = None  # the same in the simulator; None where it was not asked


@dataclass(frozen=True)
class Check:
    """One frequency by the simulator's own derivative, without play; both inf where nothing moves."""

    frequency_hz: float
    predicted_Nm_rad: complex
    simulated_Nm_rad: complex
    way: OperatingPoint = "sliding"

    @property
    def difference(self) -> float:
        """Relative difference of the two compliances."""
        if np.isinf(self.predicted_Nm_rad):
            return 0.0 if np.isinf(self.simulated_Nm_rad) else np.inf
        return abs(self.predicted_Nm_rad / self.simulated_Nm_rad - 1.0)


@dataclass(frozen=True)
class AtRest:
    """Fundamental stiffness of the drive as it is, at rest, to a sinusoidal load torque.

    inf: no motion; NaN: none that comes again in the next period, as of a drive that hunts.
    """

    moment_Nm: float
    frequency_hz: float
    simulated_Nm_rad: complex


@dataclass(frozen=True)
class Stiffness:
    """All of it for one design; ``unproven`` says why the simulator could not be asked."""

    design: Design
    curves: tuple[StiffnessCurve, ...]
    lost_motion: LostMotion | None
    checks: tuple[Check, ...] = ()
    at_rest: tuple[AtRest, ...] = ()
    unproven: str = ""

    @property
    def lost_motion_difference(self) -> float | None:
        """Relative difference of lost motion as predicted and as simulated; None where it was not read."""
        lost = self.lost_motion
        if lost is None or lost.simulated_rad is None:
            return None
        return abs(lost.simulated_rad / lost.predicted_rad - 1.0)

    @cached_property
    def requirements(self) -> tuple[RequirementVerdict, ...]:
        """Those of the design on stiffness and lost motion."""
        return judged_by(self.design, "stiffness", self)

    @property
    def verdict(self) -> Verdict:
        """The checks and the requirements together."""
        return (Tally.of([self.checked]) + tally(self.requirements)).verdict

    @property
    def checked(self) -> Verdict:
        """Whether every check agrees to `AGREED`, and lost motion to `READ`; not proven without a check."""
        if not self.checks:
            return Verdict.NOT_PROVEN
        read = (self.lost_motion_difference or 0.0) <= READ
        return Verdict.of(read and all(check.difference <= AGREED for check in self.checks))

    @property
    def passed(self) -> bool:
        """Whether it is met."""
        return self.verdict is Verdict.MET


AGREED, READ = 1e-6, 1e-5
_MOST_TICKS = 400_000
SKIPPED, LEFT = 6, 1e-4  # periods at rest, before one is looked at; what is left by then of the slowest mode
PERIODS_WITHIN = 10  # of the load on the spring, within the part of the loading that is read
POINTS = 20_000
TIME_CONSTANTS = 20.0  # of the damped load on the spring, waited at each reading


def check_stiffness(design: Design, frequencies_hz: Sequence[float]) -> tuple[Check, ...]:
    """The simulator's own derivative from the load to the output (`nonlinear.tangent`) beside the loops.

    Without play and counts; at rest without dry friction or, where friction has other slopes in motion,
    creeping with it.  An output that no load torque moves is pushed with the largest load torque.

    Raises `UnstableError`: for a loop that is not stable.
    """
    coupling, bench = design.coupling, on_the_bench(design)
    bench = replace(bench, coupling=None if coupling is None else replace(coupling, play_rad=0.0))
    return tuple(one for way in _ways(bench) for one in _checked(bench, way, np.array(frequencies_hz, float)))


def _checked(bench: Design, way: OperatingPoint, hertz: npt.NDArray[np.float64]) -> tuple[Check, ...]:
    moving = way != "sliding" or is_uneven(bench.friction)
    motion = creeping(bench, driven=way == "driven") if moving else standing(bench)
    at = replace(motion.operating(bench), point=way, speed_rad_s=0.0, angle_rad=motion.output_rad(bench))
    response = linear.compliance(bench, at)
    if response.slowest > 1.0:
        at_load = "" if way == "sliding" else f", friction by load {way}"
        raise UnstableError(f"stiffness: the closed loop is not stable{at_load}")
    if not response.moves:
        pushed = stiffness_at_rest(bench, [(each, bench.load.moment_max_Nm or 1.0) for each in hertz])
        return tuple(Check(one.frequency_hz, complex(np.inf), one.simulated_Nm_rad, way) for one in pushed)
    own = tangent(bench, "load", setup=LoopSetup(bench, "load", motion, limits_on=False))
    simulated = 1.0 / own.closed(np.exp(2j * np.pi * hertz * own.hold_s))
    predicted = linear.stiffness_at(response, hertz)
    found = zip(hertz.tolist(), predicted.tolist(), simulated.tolist(), strict=True)
    return tuple(Check(*each, way) for each in found)


def _ways(design: Design) -> list[OperatingPoint]:
    return [way for way, there in linear.ways(design) if there]


def stiffness_at_rest(design: Design, asked: Sequence[tuple[float, float]]) -> tuple[AtRest, ...]:
    """Fundamental stiffness of the drive as it is, command held, at (frequency in Hz, torque in N m)."""
    made, period, every = [], design.controller.period_s, design.controller.position_loop.every
    settling = settling_ticks_of(design, LEFT)
    for frequency, amplitude in asked:
        ticks = max(4, round(1.0 / (frequency * period * every))) * every  # a period: whole updates
        skipped = max(SKIPPED, ceil(min(settling, _MOST_TICKS) / ticks))
        count, turn = (skipped + 2) * ticks, np.exp(-2j * np.pi * np.arange(ticks) / ticks)
        moment = np.tile(-amplitude * turn.imag, skipped + 2)
        run = simulate(design, commands.hold(), count * period, series(np.arange(count) * period, moment))
        both = (moment, run.output_angle_rad - run.output_angle_rad[-1])  # at rest: 0 to the last digit
        torque, angle = (signal[skipped * ticks :].reshape(2, ticks) @ turn for signal in both)
        K = complex(torque.sum() / angle.sum()) if angle.any() else complex(np.inf)
        if abs(angle[1] - angle[0]) > STEADY * abs(angle).max():
            K = complex(np.nan)
        made.append(AtRest(amplitude, 1.0 / (ticks * period), K))
    return tuple(made)


def lost_motion_simulated(design: Design) -> float:
    """Lost motion in the simulator, the rotor held: a slow load goes to +`LOST_MOTION_SHARE`, then to -.

    The load is damped critically against the spring in place of its own friction, so that it lands behind the
    play without a bounce; at both readings it stays until it has gone through the play.

    Raises `InputError`: without a coupling, a position loop or a largest load torque.
    """
    coupling, rated = design.coupling, design.load.moment_max_Nm
    if coupling is None or design.controller.position is None or rated <= 0.0:
        raise InputError("stiffness: lost motion needs a coupling, a position loop and load.moment_max")
    J, k, period = design.load_side_inertia_kgm2, coupling.stiffness_Nm_rad, design.controller.period_s
    damping, m = 2.0 * sqrt(k * J), linear.LOST_MOTION_SHARE * rated
    held = replace(
        design,
        motor=replace(design.motor, rotor_inertia_kgm2=HELD * design.motor.rotor_inertia_kgm2),
        load=replace(design.load.bare(), friction=LoadFriction(viscous_Nms_rad=damping)),
    )
    stay = TIME_CONSTANTS * (damping + coupling.damping_Nms_rad) / k
    stay += 2.0 * coupling.play_rad * damping * design.ratio_behind_coupling / m
    way = PERIODS_WITHIN * 2.0 * np.pi * sqrt(J / k)
    ticks = np.minimum(np.array([way, stay, 2.0 * way, stay]) / period, _MOST_TICKS)
    grain = ceil(ticks.sum() / POINTS)  # ticks from one point of the loading to the next: corners are points
    ends = np.cumsum(np.maximum(np.ceil(ticks / grain), 2)).astype(int)
    points = np.arange(ends[-1] + 2)
    loading = m * np.interp(points, np.append(0, ends), [0.0, 1.0, 1.0, -1.0, -1.0])
    load = series(points * grain * period, loading)
    run = simulate(held, commands.hold(), points[-1] * grain * period, load, record_every=grain)
    up, down = (run.output_angle_rad - run.motor_angle_rad / design.total_ratio)[ends[[1, 3]]]
    return float(up - down)


STATES: tuple[State, ...] = ("powered", "shorted", "open")
CHECKED_HZ = (2.0, 10.0, 50.0)
REST_HZ = (2.0, 20.0)
REST_FRACTIONS = (0.01, 0.1, 1.0)  # of the largest load torque


def stiffness(design: AnyDesign, *, simulated: bool = True) -> Stiffness:
    """Dynamic and static stiffness and lost motion of a design.

    ``simulated``: put them to the simulator, by a load torque injected at three frequencies, and a slow one
    to either side.

    Raises `InputError`: for a loop that is not stable.
    """
    design = as_design(design)
    held = design.controller.position is not None
    checks = check_stiffness(design, CHECKED_HZ) if simulated and held else ()
    largest = design.load.moment_max_Nm if any(np.isfinite(one.predicted_Nm_rad) for one in checks) else 0.0
    asked = [(f, share * largest) for f in REST_HZ for share in REST_FRACTIONS]
    at_rest = stiffness_at_rest(design, asked) if largest > 0.0 else ()
    unproven = "no position loop holds the output" if simulated and not checks else ""
    lost = None
    if design.coupling is not None:
        play = design.coupling.play_rad / design.ratio_behind_coupling
        read = (
            lost_motion_simulated(design) if simulated and held and design.load.moment_max_Nm > 0.0 else None
        )
        lost = LostMotion(play, linear.lost_motion_rad(design), read)
    return Stiffness(design, stiffness_curves(design), lost, checks, at_rest, unproven)


def unpowered(design: Design, winding: State) -> Design:
    """The design without its loops: the winding ``shorted`` (u = 0) or ``open`` (i = 0)."""
    bare = replace(design, controller=replace(design.controller, position=None, velocity=None, current=None))
    if winding == "shorted" and design.motor.has_electrical_dynamics:
        return bare
    return replace(bare, motor=design.motor.without_current, supply=None, temperature=None)


def _telling_loads(design: Design) -> tuple[float, ...]:
    """The first load of the validation on each piece of the spring; 0 where it does not bend."""
    coupling, reached = design.coupling, dict[float, float]()
    if coupling is None or len(coupling.pieces) == 1:
        return (0.0,)
    for load in design.validation.loads_Nm:
        reached.setdefault(float(stiffness_there(design, Operating(load_Nm=load))), load)
    return tuple(reached.values())


def stiffness_curves(design: Design) -> tuple[StiffnessCurve, ...]:
    """Powered and unpowered stiffness, friction sliding, by load both ways (`actuator_lti.loops.stiffness`).

    Unpowered nothing samples: slopes of torques over the angle act at every instant; what moves the motor is
    the load, if it can.
    A spring that bends has them at each of its pieces that a load of ``validation.loads`` reaches.

    >>> from actuator_lti.design import load_design
    >>> [f"{curve.way} {curve.static_Nm_rad:.0f}" for curve in stiffness_curves(load_design("fin"))]
    ['driving 1324', 'driven 1618', 'driven 30', 'driven 30']
    """
    curves = []
    for load, state in product(_telling_loads(design), STATES):
        if state != "shorted" or design.motor.has_electrical_dynamics:
            drive = design if state == "powered" else unpowered(design, state)
            for way in _ways(design)[0 if state == "powered" else -1 :]:
                at = Operating(point=way, load_Nm=load, torques_at_once=state != "powered")
                response = linear.compliance(drive, at)
                hertz = np.union1d(linear.frequencies_hz(response), linear.weakest_hz(response))
                K, static = linear.stiffness_at(response, hertz), linear.static_stiffness(response)
                curves.append(StiffnessCurve(state, hertz, K, static, load, way))
    return tuple(curves)
