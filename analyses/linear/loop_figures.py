"""Everything that is said of a loop in one place: margins, bandwidth, peaks, step.

A load whose moment grows with its own deflection (a pendulum upright, a fin ahead of its centre of pressure)
moves away by itself, and so does a rotor whose friction falls with the speed, or on a spring that the sampled
form holds over a tick. A current loop alone, or a P velocity loop alone, does not stop that; the loops around
them do. Such a loop is unstable in itself and no fault of the drive: it is judged with the rotor locked
(current loop), or with the load's torque held (velocity loop).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import sqrt
from typing import Any, TypeVar

from actuator_lti.asked.quantities import MOST_RESONANCE_DB
from actuator_lti.bandwidth import Bandwidth, Peaks, closed_loop_bandwidth, peaks
from actuator_lti.design.model import Design, Requirement
from actuator_lti.design.plant import torque_per_command
from actuator_lti.drive.operating import RotorState, pushes_away
from actuator_lti.drive.profile import CommandMean, command_mean, profile_note
from actuator_lti.drive.steady import drive_gain
from actuator_lti.drive.wiring import wire
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.loops import Loop, Loops, sampled
from actuator_lti.loops.assemble import loops_at
from actuator_lti.loops.commanded import commanded_bandwidth, commanded_step
from actuator_lti.margins import StabilityMargins, stability_margins
from actuator_lti.step import StepFigures, step_figures
from actuator_lti.systems.as_control import as_control
from analyses.isolation import attempt

HELD = {"current": "rotor locked", "velocity": "load torque held"}
"""How an inner loop is judged that is unstable by itself, by its name."""
OPEN = {"current": "outer loops open and rotor free", "velocity": "outer loops open"}  # how it stands then
AWAY = "the load, cogging or falling friction drives it away"
ACTIVE = "held over a tick, as here and in the simulator, a slope over the angle is slightly active"


def held_loop(loops: Loops, name: str) -> Loop:
    """The inner loop with the rotor locked, or with the load's torque held."""
    at = loops.operating
    held = replace(at, rotor="locked") if name == "current" else replace(at, torques_held=True)
    return loops_at(loops.design, held, loops.form, loops.inner_loops).present[name]


def other_loops(loops: Loops, design: Design, *, rotor: RotorState = "free") -> Loops:
    """The loops of another design, or with another rotor, in the same form at the same operating point."""
    at = replace(loops.operating, rotor=rotor, torques_held=False)
    return loops_at(design, at, loops.form, loops.inner_loops)


Figure = TypeVar("Figure")


@dataclass(frozen=True)
class LoopFigures:
    """The figures of one loop."""

    loop: Loop
    # What bandwidth and step are taken of, behind ``mean``: the closed loop; for the position loop the
    # command to the output, feed-forward and filter of the command included; for another loop with a law of
    # one's own its command to what it measures. A plain or python-control system
    plain_response: Any
    margins: StabilityMargins  # of the open loop
    # ``None`` where the closed loop is not stable, or has no such figure (then ``notes`` say why)
    bandwidth: Bandwidth | None
    peaks: Peaks | None
    step: StepFigures | None
    notes: tuple[str, ...] = ()
    # Of an inner loop that is unstable only by itself, in a drive that is stable as a whole: the same loop as
    # `held_loop` holds it, which is stable
    held: LoopFigures | None = None
    by_hold: bool = False  # unstable only as a torque over the angle is held over a tick
    locked: LoopFigures | None = None  # of a current loop with a free rotor, where it was asked for: locked
    mean: CommandMean | None = None  # of a limited jerk, between the user's command and ``plain_response``
    reference: LoopFigures | None = None  # of a position loop with a mean or filter: behind them

    def asked(self, requirement: Requirement) -> LoopFigures:
        """The figures that a requirement means: of which current loop, of which response."""
        if requirement.rotor == "locked" and self.locked is not None:
            return self.locked
        if requirement.to == "reference" and self.reference is not None:
            return self.reference
        return self.judged

    @property
    def rotor(self) -> str:
        """How the rotor stands, of a current loop as it is judged: ``"free"`` or ``"locked"``; else empty."""
        return self.judged.loop.rotor if self.loop.name == "current" else ""

    @property
    def judged(self) -> LoopFigures:
        """The figures that the drive is judged by: those of `held` where there are some."""
        return self if self.held is None else self.held

    @property
    def by_itself(self) -> str:
        return f"{OPEN[self.loop.name]}, as {ACTIVE if self.by_hold else AWAY}"

    @property
    def is_stable(self) -> bool | None:
        """Whether the loop, as it is judged, is stable; ``None`` where that is not known."""
        return self.judged.margins.stable

    @cached_property
    def response(self) -> Any:
        return as_control(self.plain_response)

    @property
    def of_feedback(self) -> bool:
        """Whether bandwidth and step are those of the feedback loop alone, without what the command adds."""
        return self.plain_response is self.loop.plain_closed

    @property
    def stable(self) -> bool:
        return self.margins.stable is True


def loop_figures(
    loop: Loop, response: Any = None, *, bandwidth: bool = True, step: bool = True, certify: bool = False,
    mean: CommandMean | None = None,
) -> LoopFigures:  # fmt: skip
    """Compute all figures of a loop; ``certify``: its margins by exact arithmetic, see `stability_margins`.

    Bandwidth and step (that of a continuous loop with delays takes its time) are those of ``response``, else
    of what answers the command (the closed loop, mostly), behind the ``mean`` of the command.

    Raises `InputError`, `NumericalError`: if the margins cannot be found; another figure that cannot becomes
    a note.
    """
    responses = response, loop.plain_commanded, loop.plain_closed
    response = next(one for one in responses if one is not None)
    margins = stability_margins(loop.plain_open, certify=certify)
    if margins.stable is not True:
        return LoopFigures(loop, response, margins, None, None, None)
    bare = LoopFigures(loop, response, margins, None, peaks(loop.plain_open), None)
    return _responding(bare, response, mean, bandwidth=bandwidth, step=step)


def _responding(
    figures: LoopFigures, response: Any, mean: CommandMean | None, *, bandwidth: bool = True, step: bool
) -> LoopFigures:
    """The same with bandwidth and step of a response, behind the mean of the command where there is one."""
    notes: list[str] = []

    def band() -> Bandwidth:
        own = closed_loop_bandwidth(response)
        if own.resonance_peak_db > MOST_RESONANCE_DB:  # its gain at zero is what rounding leaves of zero
            raise InputError(
                "the response at zero frequency is less than 1e-5 of its largest value: there is nothing to "
                "measure the fall and the resonance from"
            )
        if not sqrt(0.5) < abs(own.dc_gain) < sqrt(2.0):  # by 3 dB or more, beyond what a bandwidth lets pass
            notes.append(
                f"{figures.loop.name} loop: a constant command gives {abs(own.dc_gain):.4g} of it; -3 dB and "
                "overshoot are relative to that and do not say how fast the loop is: its gain crossover does"
            )
        return own if mean is None else commanded_bandwidth(response, mean)

    def steps() -> StepFigures:
        own = step_figures(response)
        return own if mean is None else commanded_step(response, own, mean)

    return replace(
        figures, plain_response=response, bandwidth=_if_there_is(band, notes) if bandwidth else None,
        step=_if_there_is(steps, notes) if step else None, notes=tuple(dict.fromkeys(notes)), mean=mean,
    )  # fmt: skip


def _if_there_is(call: Callable[[], Figure], notes: list[str]) -> Figure | None:
    """Give a figure; where there is none (no gain at DC, say) or none is found, note the reason instead."""
    try:
        return call()
    except (InputError, NumericalError) as error:
        notes.append(str(error))
        return None


def all_loop_figures(
    loops: Loops, *, step: bool = True, refused: list[str] | None = None, certify: bool = False,
    locked: bool | None = None,
) -> dict[str, LoopFigures]:  # fmt: skip
    """Compute the figures of every loop that the design has, innermost first, by name; see `loop_figures`.

    A loop whose margins cannot be found is left out, and the reason added to ``refused`` where that is given.
    ``locked``: the current loop with the rotor locked as well; where left out, if a requirement is on it.
    Without such a requirement it may fail alone, inside `analyses.isolation.isolated`.

    Raises `InputError`, `NumericalError`: if the margins of a loop cannot be found, and ``refused`` is not
    given.
    """
    result = {}
    needed = any(r.rotor == "locked" for r in loops.design.requirements)
    wanted = (needed if locked is None else locked) and loops.operating.rotor != "locked"
    for name, loop in loops.present.items():
        try:
            if name == "position":
                result[name] = _position(loops, loop, step=step, certify=certify)
            else:
                result[name] = loop_figures(loop, step=step, certify=certify)
            if name == "velocity" and result[name].stable:
                result[name] = _noting_speed(loops.design, result[name])
            if name == "current" and result[name].stable:
                result[name] = _noting_feedforward(loops.design, result[name])
            if name == "current" and wanted:
                own = partial(_locked, loops, step=step, certify=certify)
                with_it = own() if needed else attempt("current loop with the rotor locked", own, None)
                result[name] = replace(result[name], locked=with_it)
        except (InputError, NumericalError) as error:
            if refused is None:
                raise
            refused.append(f"{name} loop, {loops.form}, {loops.operating_point}: {error}")
    outermost = result.get(loops.design.controller.outermost)
    whole = outermost is not None and outermost.stable
    for name, one in result.items():
        lost = whole and one.margins.stable is False
        if lost or (certify and locked):
            one = _noting_hold(loops, one)
        if lost and (one.by_hold or pushes_away(loops.design, loops.operating)):  # else its own fault
            kept = partial(loop_figures, held_loop(loops, name), step=step, certify=certify)
            held = one.locked or _if_there_is(kept, [])
            one = replace(one, held=held if held is not None and held.stable else None)
        result[name] = one
    return result


def _noting_speed(design: Design, figures: LoopFigures) -> LoopFigures:
    """The same of an outermost velocity loop with a note where its measured speed is not the speed itself."""
    encoder, velocity = design.encoder, design.controller.velocity
    if velocity is None or design.controller.outermost != "velocity":
        return figures
    if encoder.speed == "ideal" and not encoder.filter_time_s and not velocity.filters_on("speed"):
        return figures
    note = "velocity loop: bandwidth and step are of the measured speed, behind its estimate and filters"
    return replace(figures, notes=(*figures.notes, note))


def _noting_feedforward(design: Design, figures: LoopFigures) -> LoopFigures:
    """The same of a current loop with a note on the feed-forward that its closed loop is without."""
    current = design.controller.current
    if current is None or current.resistance_feedforward == 0.0 or not figures.of_feedback:
        return figures
    given = drive_gain(design) / torque_per_command(design)
    note = "current loop: all of this is of the feedback alone; with control.current.resistance_feedforward"
    return replace(figures, notes=(*figures.notes, f"{note} a constant command gives {given:.4g} of it"))


MATTERS = 0.01  # of a margin


def _noting_hold(loops: Loops, figures: LoopFigures) -> LoopFigures:
    """The same with a note where the drive's own torques, held over a tick (model.md section 6), matter."""
    if loops.tick_system is None:
        return figures
    name, plant = figures.loop.name, loops.tick_system.program.drive.plant
    acting = [word for word, own in (("cogging", plant.torque), ("load torque", plant.load_torque)) if own]
    if not acting:
        return figures
    motor = wire(loops.design, replace(loops.operating, torques_at_once=True))
    loop = sampled.loop(motor, name, motor.inside(name) if loops.inner_loops == "open" else ())
    other = _if_there_is(lambda: stability_margins(loop.plain_open), [])
    if other is None or not (said := _differing(figures.margins, other)):
        return figures
    note = f"{name} loop: {said} if {' and '.join(acting)} acted at every instant, as in the motor; {ACTIVE}"
    by_hold = figures.margins.stable is False and other.stable is True
    return replace(figures, notes=(*figures.notes, note), by_hold=by_hold)


def _differing(margins: StabilityMargins, other: StabilityMargins) -> str:
    if other.stable is not margins.stable:
        return "stable" if other.stable else "not stable"
    if not other.stable:
        return ""
    words = {"gain margin": ("gain_margin_db", "dB"), "phase margin": ("phase_margin_deg", "deg")}
    said = []
    for what, (key, unit) in words.items():
        here, there = getattr(margins, key), getattr(other, key)
        if here is not None and there is not None and abs(there - here) > MATTERS * abs(there):
            said.append(f"{what} {there:.4g} {unit}")
    return " and ".join(said)


def _locked(loops: Loops, *, step: bool, certify: bool) -> LoopFigures:
    fixed = other_loops(loops, loops.design, rotor="locked").present["current"]
    return loop_figures(fixed, step=step, certify=certify)


def _position(loops: Loops, loop: Loop, *, step: bool, certify: bool) -> LoopFigures:
    """The position loop, its response to the command, and to the reference where that is another."""
    design, mean = loops.design, command_mean(loops.design)
    figures = loop_figures(loop, loops.plain_response, step=step, certify=certify, mean=mean)
    filtered = design.command.filter_time_s > 0.0
    if not figures.stable or not (filtered or mean):
        return figures
    response = loops.plain_response
    if filtered:
        bare = replace(design, command=replace(design.command, filter_time_s=0.0))
        response = other_loops(loops, bare).plain_response
    reference = _responding(figures, response, None, step=step)
    said = (profile_note(design),) if mean else ()
    return replace(figures, reference=reference, notes=(*figures.notes, *said))
