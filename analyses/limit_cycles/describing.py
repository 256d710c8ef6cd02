"""Cycles of play, dry friction and quantisation by describing function inside the exact sampled loop.

A cycle is predicted where an oscillating eigenvalue of the whole closed loop lies on the unit circle.

Play: the torque's fundamental is that of the coupling with k and c times ``n(x) = 1 - (2/pi)(asin x + x
sqrt(1 - x^2))``, x = b/A. Dry friction: the slope ``4 Tc/(pi W)``, W the amplitude of its speed; none of
breakaway, at which a sinusoid spends no time, and in cycles of play none by load. Quantisation: an angle that
swings about the edge of a count is a relay, ``2 q/(pi A)`` up to A = q; the loop of its sensor (the motor's:
of the speed made of it) has the cycle at the gain g that brings it to the limit: ``A = 2 q/(pi g)``,
stable.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from itertools import pairwise
from math import exp, log, nan, pi
from typing import Literal

import numpy as np

from actuator_lti.design.model import Coupling, Design, Filter, Friction, LoadFriction, Sensor
from actuator_lti.drive.operating import Operating, dead_zone, described_dry, dry_torque, slope_at
from actuator_lti.drive.wiring import wire
from actuator_lti.loops import assemble_loops
from actuator_lti.loops.periodic import exact_margins, point_blocks
from actuator_lti.loops.tick import TickProgram
from actuator_lti.systems.root import root
from actuator_lti.types import Floats

Follow = Callable[[float, "Mode | None"], "Mode | None"]  # the nearest, or the least damped
Cause = Literal["play", "quantisation", "motor-quantisation", "friction"]
# The sensor whose counts they are, and the other one
SENSORS: dict[Cause, tuple[Sensor, Sensor]] = {
    "quantisation": ("output", "motor"),
    "motor-quantisation": ("motor", "output"),
}
LEAST, MOST, POINTS = 1.02, 300.0, 48  # of the half play: amplitudes of the twist that are looked at
MOST_GAIN, GAINS = 1e3, 73  # of a speed made of counts
SPEEDS, DECADES = 36, 6.0  # of the motor, that friction is looked at with
RESOLVED = 1e-9  # of the radius
_TURNS = 1e-6  # least angle of an eigenvalue that oscillates
_GONE = 0.01  # in one period: no oscillation; eigenvalues of what is late are zero, and rounding turns them
_STEPS, _SETTLED = 60, 1e-9  # of the fixed point between both speeds and the eigenvalue
_SAME = 1e-6  # so near are two eigenvalues of one oscillation


@dataclass(frozen=True)
class Cycle:
    """A limit cycle by describing function."""

    cause: Cause  # quantisation: of the output's sensor, or of the motor's
    with_friction: bool  # whether the drive's dry friction, by its own describing function, is in it
    output_rad: float  # amplitude of the output, peak
    inner_rad: float  # what the nonlinearity sees: twist, sensor's angle, motor's speed (rad/s)
    frequency_hz: float
    stable: bool  # whether motion near it comes nearer; ``False``: the limit between dying out and growing
    state: dict[str, complex]  # its shape by state of the loop, at this amplitude
    load_Nm: float = 0.0  # load torque that it is at


@dataclass(frozen=True)
class Mode:
    """An oscillation of the loop over a position period, of any size."""

    value: complex  # its eigenvalue
    frequency_hz: float
    shape: dict[str, complex]

    @property
    def excess(self) -> float:
        """By how much it grows over the period."""
        return abs(self.value) - 1.0


def cycles_of_play(design: Design, *, friction: bool) -> tuple[Cycle, ...]:
    """Every cycle with a twist between `LEAST` and `MOST` times the half play, smallest first."""
    coupling = design.coupling
    if coupling is None or coupling.play_rad <= 0.0 or design.controller.position is None:
        return ()
    half = 0.5 * coupling.play_rad
    grid = log(half) + np.log1p(np.geomspace(LEAST - 1.0, MOST - 1.0, POINTS))
    own = partial(_cycle, "play", design, friction=friction)
    found = kept_up(lambda log_A, near: _at_twist(design, exp(log_A), friction, near), grid)
    return tuple(own(there, exp(log_A), there.shape["twist"], stable=s) for log_A, there, s in found)


def cycles_of_friction(design: Design, load_Nm: float, top_speed_rad_s: float) -> tuple[Cycle, ...]:
    """Every cycle with a motor speed up to ``top_speed_rad_s``, over six decades."""

    def mode(log_speed: float, near: Mode | None) -> Mode | None:
        at = Operating(point="describing-function", load_Nm=load_Nm, speed_amplitude_rad_s=exp(log_speed))
        return mode_at(design, at, near)

    grid = log(top_speed_rad_s) - np.linspace(DECADES, 0.0, SPEEDS) * log(10.0)
    own, found = partial(_cycle, "friction", design, friction=True), kept_up(mode, grid)
    cycles = (own(there, exp(speed), there.shape["w"], stable=stable) for speed, there, stable in found)
    return tuple(replace(cycle, load_Nm=load_Nm) for cycle in cycles)


def _cycle(
    cause: Cause, design: Design, mode: Mode, inner: float, seen: complex, *, friction: bool, stable: bool
) -> Cycle:
    """The cycle whose nonlinearity sees ``inner``, where it sees ``seen`` of the mode."""
    state = {name: inner / seen * value for name, value in mode.shape.items()}
    output = abs(output_of(design, state))
    return Cycle(cause, friction, output, inner, mode.frequency_hz, stable, state)


def at_load(cycle: Cycle, design: Design, load_Nm: float) -> Cycle:
    """The same cycle at another load torque: the critical slope is the same, so W goes with Tc."""
    ratio = dry_Nm(design, load_Nm) / dry_Nm(design, cycle.load_Nm)
    return replace(
        cycle,
        inner_rad=ratio * cycle.inner_rad,
        output_rad=ratio * cycle.output_rad,
        state={name: ratio * value for name, value in cycle.state.items()},
        load_Nm=load_Nm,
    )


def dry_Nm(design: Design, load_Nm: float) -> float:
    """Dry friction at the motor, forward and backward together; of a friction map that at its first point."""
    return float(dry_torque(design, load_Nm, 1) + dry_torque(design, load_Nm, -1))


def kept_up(mode: Follow, grid: Floats) -> Iterator[tuple[float, Mode, bool]]:
    """Where along a grid an oscillation keeps its size, of those that are the least damped somewhere.

    Gives value, oscillation, and whether it dies out beyond: an amplitude at which it attracts.
    """
    last: Mode | None = None
    for low, value in pairwise([nan, *map(float, grid)]):
        now, least = last and mode(value, last), mode(value, None)
        followed = [(last, now)]
        if last and least and not (now and abs(least.value - now.value) < _SAME):
            followed.append((mode(low, least), least))
        for before, after in followed:
            if before and after and _changes(before.excess, after.excess):
                yield from _limit(mode, low, value, before)
        last = max((one for one in (now, least) if one), key=lambda one: one.excess, default=None)


def _limit(mode: Follow, low: float, value: float, near: Mode) -> Iterator[tuple[float, Mode, bool]]:
    """Where between two values the oscillation near one at the first keeps its size."""

    def excess(x: float) -> float:
        found = mode(x, near)
        return -1.0 if found is None else found.excess

    if _changes(excess(low), excess(value)):
        there = mode(at := root(excess, low, value, 1e-12), near)
        if there and abs(there.excess) < _SAME:
            yield at, there, near.excess > 0.0


def _changes(a: float, b: float) -> bool:
    """Whether a sign changes by more than rounding of a mode that nothing moves."""
    return a * b < 0.0 and max(abs(a), abs(b)) > RESOLVED


def _at_twist(design: Design, A: float, friction: bool, near: Mode | None) -> Mode | None:
    """The oscillation near one, or the least damped, at a twist of amplitude A, the speeds in it its own.

    With friction a fixed point, begun with the shape of the one ``near``, or without friction. None: it does
    not settle, or friction stops it.
    """
    mode = near if near and friction else mode_at(_equivalent(design, A, None), Operating(), near)
    if mode is None or not friction:
        return mode
    speeds = _speeds(design, mode, A)
    for _ in range(_STEPS):
        last, mode = mode, mode_at(_equivalent(design, A, speeds), Operating(), mode)
        if mode is None or abs(mode.value - last.value) < _SETTLED:
            return mode
        speeds = _speeds(design, mode, A) ** 0.6 * speeds**0.4
    return None


def _speeds(design: Design, mode: Mode, A: float) -> Floats:
    """Amplitudes of the motor's and the load's speed at a twist of amplitude A; one that rests has few."""
    ratios, shape = np.array([design.ratio_to_coupling, 1.0]), mode.shape
    ends = A / abs(shape["twist"]) * np.abs([shape["w"], shape["W"]]) / ratios
    return ratios * np.maximum(ends, RESOLVED * ends.max())


def _equivalent(design: Design, A: float, speeds: Floats | None) -> Design:
    """The linear drive of the same fundamentals."""
    coupling, behind = design.coupling, design.load.friction or LoadFriction()
    assert coupling is not None
    half, (_, _, k), n = 0.5 * coupling.play_rad, coupling.pieces[0], dead_zone(0.5 * coupling.play_rad / A)
    stiffness, damping = n * k, n * coupling.damping_Nms_rad
    for _, twist, beyond in coupling.pieces[1:]:  # each bend is a dead zone of its own
        stiffness, k = stiffness + (beyond - k) * dead_zone((half + twist) / A), beyond
    own = replace(design.friction, load_coefficient=0.0)
    slope, load_slope = own.viscous_Nms_rad, behind.viscous_Nms_rad
    if speeds is not None:
        at = Operating(point="describing-function", speed_amplitude_rad_s=float(speeds[0]))
        slope = slope_at(replace(design, friction=own), at)
        load_slope += described_dry(behind.dry_torque_Nm, float(speeds[1]))
    spring = Coupling(stiffness_Nm_rad=stiffness, damping_Nms_rad=damping, after=coupling.after)
    load = replace(design.load, friction=LoadFriction(viscous_Nms_rad=load_slope))
    return replace(design, coupling=spring, friction=Friction(viscous_Nms_rad=slope), load=load)


def mode_at(design: Design, at: Operating, near: Mode | None) -> Mode | None:
    """The oscillation near one, or the least damped, of the linear loop at a point; None without any."""
    program = TickProgram(wire(design, at), "position")
    return _oscillation([program.tick(k).A for k in range(program.ticks)], program.states, design, near)


def output_of(design: Design, state: dict[str, complex]) -> complex:
    """The output in a state of the loop: phi = th/N_c - twist, behind the coupling."""
    if design.coupling is None:
        return state["th"] / design.total_ratio
    phi = state["th"] / design.ratio_to_coupling - state["twist"]
    return phi / design.ratio_behind_coupling


def quantum_of(design: Design, cause: Cause) -> float | None:
    """One count of a sensor: of the output's in rad at the output, of the motor's in rad at the motor."""
    return design.output_quantum_rad if cause == "quantisation" else design.angle_quantum_rad


def counts_matter(design: Design, cause: Cause) -> bool:
    """Whether a loop sees the counts of a sensor (the motor's: where a speed is made of them)."""
    position, velocity = design.controller.position, design.controller.velocity
    if position is None or quantum_of(design, cause) is None:
        return False
    if cause == "quantisation":
        return position.sensor == "output"
    return velocity is not None and velocity.sensor == "motor" and design.encoder.speed != "ideal"


def cycles_of_quantisation(design: Design, causes: Iterable[Cause] = tuple(SENSORS)) -> tuple[Cycle, ...]:
    """The cycles about the edge of a count of each sensor, which the gain ``2 q/(pi A)`` keeps up."""
    free, found = without_nonlinearities(design), []
    for cause in causes:
        if not counts_matter(design, cause):
            continue
        limit = _limit_at_output(free) if cause == "quantisation" else _limit_of_speed(free)
        if limit is not None:
            gain, mode = limit
            amplitude = 2.0 * (quantum_of(design, cause) or 0.0) / (pi * gain)
            seen = output_of(free, mode.shape) if cause == "quantisation" else mode.shape["th"]
            found.append(_cycle(cause, free, mode, amplitude, seen, friction=False, stable=True))
    return tuple(found)


def _limit_at_output(free: Design) -> tuple[float, Mode] | None:
    """Gain of a sensor at the output that brings the loop to its stability limit, and the oscillation there.

    A speed made of that angle too makes the loop that at the velocity controller's output.
    """
    control, point = free.controller, "output"
    velocity = control.velocity
    if velocity is not None and velocity.sensor == "output" and free.encoder.speed != "ideal":
        point = "u" if control.current is None else "i_ref"
    critical_gain = exact_margins(assemble_loops(free), point, 0.0).gain_upper
    if not np.isfinite(critical_gain):  # none, or the linear loop is unstable
        return None
    blocks = point_blocks(wire(free, Operating()), point)
    ticks = [block.A - critical_gain * block.B @ block.C for block in blocks]
    mode = _oscillation(ticks, blocks[0].states, free, at_limit=True)
    return None if mode is None else (critical_gain, mode)


def _limit_of_speed(free: Design) -> tuple[float, Mode] | None:
    """Gain of a speed made of the motor's angle, linear in a tick, that brings the loop to its limit."""
    velocity = free.controller.velocity
    assert velocity is not None
    programs = []
    for gain in (1.0, 2.0):
        filters = (*velocity.filters, Filter(kind="biquad", on="speed", b=(gain,), a=(0.0,)))
        control = replace(free.controller, velocity=replace(velocity, filters=filters))
        programs.append(TickProgram(wire(replace(free, controller=control), Operating()), "position"))
    plain, double = programs
    both = [(plain.tick(k).A, double.tick(k).A) for k in range(plain.ticks)]

    def mode(log_gain: float, near: Mode | None) -> Mode | None:
        ticks = [one + (exp(log_gain) - 1.0) * (two - one) for one, two in both]
        return _oscillation(ticks, plain.states, free, near)

    found = next(kept_up(mode, np.log(np.geomspace(1.0, MOST_GAIN, GAINS))), None)
    if found is None or found[2]:  # unstable from the first
        return None
    return exp(found[0]), found[1]


def _oscillation(
    ticks: Sequence[np.ndarray], states: Sequence[str], design: Design, near: Mode | None = None,
    *, at_limit: bool = False,
) -> Mode | None:  # fmt: skip
    """The eigenvalue that turns nearest to one or to the unit circle, or the largest; None without any."""
    values, vectors = np.linalg.eig(reduce(lambda A, tick: tick @ A, ticks))
    turning = np.flatnonzero((np.angle(values) > _TURNS) & (np.abs(values) > _GONE))
    if not turning.size:
        return None
    size = np.abs(values[turning])
    far = np.abs(values[turning] - near.value) if near else np.abs(size - 1.0) if at_limit else -size
    k = int(turning[np.argmin(far)])
    period = wire(design, Operating()).period_s("position")
    frequency = float(np.angle(values[k])) / (2.0 * pi * period)
    shape = dict(zip(states, map(complex, vectors[:, k]), strict=True))
    return Mode(complex(values[k]), frequency, shape)


def without_nonlinearities(design: Design) -> Design:
    """The drive in contact, without play, friction by load and dry friction."""
    coupling, behind = design.coupling, design.load.friction
    smooth = None if behind is None else LoadFriction(viscous_Nms_rad=behind.viscous_Nms_rad)
    return replace(
        design,
        coupling=None if coupling is None else replace(coupling, play_rad=0.0),
        friction=Friction(viscous_Nms_rad=design.friction.viscous_Nms_rad),
        load=replace(design.load, friction=smooth),
    )
