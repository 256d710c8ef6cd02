"""Validate a design: every linear prediction checked by the simulator, and where it stops holding."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import import_module
from math import inf, pi
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, TooManyTicks
from analyses.isolation import attempt
from analyses.loop_figures import LoopFigures, loop_figures
from analyses.validation.at_rest import RestSweep, free_amplitude, sweep_from_rest
from analyses.validation.breakaway import breakaway_entry
from analyses.validation.budget import Budget, OutOfTime
from analyses.validation.coherent import LEAST_SAMPLES
from analyses.validation.commanded import command_step, command_sweep
from analyses.validation.conditional import Conditional, conditional_stability
from analyses.validation.confirm import (
    Confirmation,
    Question,
    confirm_margins,
    point_questions,
    stage_questions,
)
from analyses.validation.counts import Counts, counts_of
from analyses.validation.figures import NotMeasured, hertz, measure_figures
from analyses.validation.from_rest import RestSteps, rest_entries, steps_from_rest
from analyses.validation.ledger import (
    Entry,
    command_entry,
    loop_entries,
    not_judged,
    point_entries,
)
from analyses.validation.release import AmplitudeMargin, release_margins
from analyses.validation.response import Sweep, errors_beside, linear_response, sweep_errors
from analyses.validation.result import LoopValidation, PointValidation, Validation
from analyses.validation.settings import Settings
from analyses.validation.steady import steady_entry
from analyses.validation.sweep import (
    EVER_TICKS,
    SETTLE_TIME_CONSTANTS,
    settling_ticks_of,
    stepped_sine,
)
from analyses.validation.tones import tone_sweep
from analyses.validation.transient import coarse, is_slow, transient_of
from analyses.validation.unstable import unstable_entry
from nonlinear import Rows
from nonlinear.loop_setup import LoopSetup, every, loop_setup, points_of, stages_of, standing_setup
from nonlinear.on_the_bench import on_the_bench
from nonlinear.operating_motion import may_stand, on_its_stand, operating_motion

if TYPE_CHECKING:
    from actuator_lti.loops import ExactMargins, Loop, Loops

Floats = npt.NDArray[np.float64]
Progress = Callable[[int, int], None]
T = TypeVar("T")
U = TypeVar("U")
HIGHEST = 0.49  # of the sampling frequency
LOADED = ("actuator_lti.loops.limiter_responses", "scipy.interpolate", "scipy.ndimage", "scipy.optimize")
THIRD_OF_NYQUIST = 0.5 / 3.0
LONGEST_STEP_TICKS = 400_000
NEAR = (0.9, 0.95, 1.0, 1.05)
NO_POSITION = "a drive without a position loop: its loops are judged, motion from rest to an angle is not"
ABOUT = (0.98, 1.0, 1.02)  # frequencies about each figure, beside the grid
LOWEST = 1e-5  # of the highest frequency: what lies lower takes too long to measure
LOWEST_OF_A_STEP = 1e-9  # its length does not depend on the frequency
PER_DECADE = 6  # frequencies of a sweep, at least
HIDING = 10.0  # settling time over the shortest window
ANSWERS = 12  # frequencies of the response to the command
BELOW = 20.0  # the sweep begins so far below the lowest figure


def validate(
    design: Design,
    settings: Settings | None = None,
    progress: Progress | None = None,
    *,
    model: Design | None = None,
) -> Validation:
    """Check every linear prediction of a design by the nonlinear simulator.

    Parameters
    ----------
    design : Design
    settings : Settings, optional
        Extent; by default everything (`analyses.validation.settings`).
    progress : callable, optional
        Called with (steps done, steps in all).
    model : Design, optional
        The drive that the linear predictions are made of, by default the same: a wrong one shows what a
        validation sees.

    Returns
    -------
    Validation
        With the ledger of predictions; ``passed`` is the verdict.

    Raises
    ------
    InputError
        If the design cannot be tested (no steady motion: dry friction takes the whole current, say).
    NumericalError
        From the computations.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> from analyses.validation.settings import QUICK
    >>> result = validate(load_design("ilr33-amber"), QUICK)
    >>> result.passed
    True
    """
    return _Work(design, settings or Settings(), progress, model or design).run()


@dataclass
class _Work:
    """One validation under way."""

    design: Design
    settings: Settings
    progress: Progress | None
    model: Design
    seconds: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    budget: Budget = field(init=False)
    linear: Design = field(init=False)
    figures: dict[str, LoopFigures] = field(default_factory=dict)
    settle: dict[str, int] = field(default_factory=dict)
    held: Loop | None = None
    rigs: dict[str, LoopSetup] = field(default_factory=dict)
    held_by_friction: tuple[str, ...] = ()
    answer_loops: Any = None
    at: dict[str, Any] = field(default_factory=dict)
    done: int = 0
    STEPS = 12

    def __post_init__(self) -> None:
        """Take the instruments' errors out of the small signals, and start the clock."""
        self.linear = on_its_stand(on_the_bench(self.design))
        self._warm_up()
        self.budget = Budget(self.settings.seconds)
        if replace(self.linear, command=self.design.command) != self.design:
            self.notes.append("small signals are measured with ideal instruments: without counts and noise")
        if self.linear.friction != self.design.friction:
            self.notes.append(
                "small signals are measured without friction of two slopes: by load, by direction, a map"
            )

    def _warm_up(self) -> None:
        """Have the simulator compiled, and libraries loaded, before the clock starts."""
        for name in LOADED:
            import_module(name)
        rows = Rows.of(self.design)
        rows["ticks"] = 2 * max(every(self.design, stage) for stage in (*stages_of(self.design), "current"))
        rows.run()

    def run(self) -> Validation:
        with self.timed("linear loops"):
            self.loops = self._assemble()
        stable = all(result.stable for result in self.figures.values())
        if not stable:
            self.notes.append("a linear loop is not known to be stable: nothing is measured around it")
            self.held_by_friction = self._held_by_friction()
        placed = self.design.controller.position is not None
        whole = stable and placed
        if not placed:
            self.notes.append(NO_POSITION)
        with self.timed("frequency response"):
            share = 0.6 / max(len(self.loops.present), 1)
            loops = {name: self._loop(name, loop, share) for name, loop in self._stage_loops().items()}
        with self.timed("margins in time"):
            confirmed = self._within(0.5, "margins in time", self._confirm, ())
        ready = stable and bool(self.settle)
        with self.timed("break points"):
            points = self._within(0.3, "break points", lambda: self._points(confirmed), {}) if ready else {}
        with self.timed("response to the command"):
            answer = self._within(0.2, "response to the command", self._answer, None) if stable else None
        with self.timed("constant speed"):
            steady = self._within(0.1, "constant speed", self._steady, None) if ready else None
            started = self._within(0.1, "breakaway", self._breakaway, None) if stable else None
        with self.timed("from rest"):
            nothing = (None, None)
            rest_sweep, rest_steps = (
                self._within(0.3, "motion from rest", self._rest, nothing) if whole else nothing
            )
        with self.timed("conditional stability"):
            conditional = (
                self._within(0.4, "conditional stability", self._conditional, None) if whole else None
            )
        with self.timed("margins by amplitude"):
            wanted = stable and self.settings.amplitude_margins
            released = (
                self._within(0.4, "margins by amplitude", lambda: self._release(confirmed), ())
                if wanted
                else ()
            )
        with self.timed("counts of the encoders"):
            counts = self._within(0.2, "counts of the encoders", self._counts, ()) if whole else ()
        large, friction, specification = self._others(whole)
        for name, loop in loops.items():
            own = tuple(item for item in confirmed if item.loop == name)
            loops[name] = _with_confirmations(loop, own)
        return Validation(
            design=self.design,
            ledger=(
                *self._ledger(loops, points, rest_steps, rest_sweep),
                *self._answered(answer),
                *(row for row in (steady, started) if row is not None),
            ),
            command=answer,
            counts=counts,
            loops=loops,
            points=points,
            amplitude_margins=released,
            conditional=conditional,
            rest_sweep=rest_sweep,
            rest_steps=rest_steps,
            large_signals=large,
            friction=friction,
            specification=specification,
            seconds=self.seconds,
            notes=tuple(dict.fromkeys([*self.notes, *self.budget.cut])),
            held_by_friction=self.held_by_friction,
        )

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Note how long a part takes, and count it as a step."""
        started = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - started
        self.done += 1
        if self.progress is not None:
            self.progress(self.done, self.STEPS)

    def _within(self, share: float, name: str, work: Callable[[], T], otherwise: U) -> T | U:
        """A part within its share of the time, alone in its failure; what refuses the drive is noted."""

        def refused() -> T | U:
            try:
                return work()
            except (InputError, NotMeasured, TooManyTicks) as error:
                self.notes.append(f"{name}: not judged: {error}")
                return otherwise

        return attempt(name, lambda: self.budget.within(share, name, refused, otherwise), otherwise)

    def _held_by_friction(self) -> tuple[str, ...]:
        """Loops that are not stable as they are tested, but are with the friction that is left out there."""
        from actuator_lti.loops import assemble_loops

        if self.linear.friction == self.design.friction:
            return ()
        whole = assemble_loops(on_the_bench(self.model), **self.at)
        figures = {name: loop_figures(loop, whole.plain_response) for name, loop in whole.present.items()}
        return tuple(name for name, own in figures.items() if own.stable and not self.figures[name].stable)

    def _stage_loops(self) -> dict[str, Loop]:
        """The loops by name; that of the current with the rotor held."""
        loops = dict(self.loops.present)
        if self.held is not None:
            loops["current"] = self.held
        return loops

    def _assemble(self) -> Loops:
        """The linear loops, their figures, and the rigs to test them on."""
        from actuator_lti.loops import assemble_loops

        point = operating_motion(self.linear).operating(
            self.linear
        )  # a drive without steady motion cannot be tested
        at = {"operating_point": point.point, "speed_rad_s": point.speed_rad_s}
        model = on_its_stand(on_the_bench(self.model), self.design)
        self.at = at
        loops = assemble_loops(replace(model, command=self.model.command), **at)  # type: ignore[arg-type]
        self.held = None
        if "current" in loops.present:
            self.held = assemble_loops(model, rotor="locked").current
        self.loops = loops
        for name, loop in self._stage_loops().items():
            self.figures[name] = loop_figures(loop)
            if self.figures[name].stable:
                held = loop_setup(self.linear, name).hold_ticks
                self.settle[name] = settling_ticks_of(loop.plain_closed, held, self.design.name)
        position = self.design.controller.position
        if position is not None and position.feedforward != 0.0:
            self.notes.append("the loops are tested without the feed-forward, which is no part of them")
        return loops

    def _loop(self, name: str, loop: Loop, share: float) -> LoopValidation:
        """Sweep one loop and read its figures; where that cannot be done, say why."""
        figures, nothing = self.figures[name], np.empty(0, complex)
        reason = f"the linear loop is {figures.margins.verdict}: there is nothing to measure"
        if name in self.settle:
            try:
                with self.budget.part(share):
                    return self._measured(name, loop)
            except OutOfTime:
                reason = f"cut: its share of {self.budget.seconds:g} s of processor time was used up"
                self.budget.cut.append(f"{name} loop: {reason}")
            except (NotMeasured, InputError, TooManyTicks) as error:
                reason = str(error)
        return LoopValidation(name, figures, None, nothing, nothing, None, None, None, None, (), reason)

    def _measured(self, name: str, loop: Loop) -> LoopValidation:
        """Sweep one stable loop and read its figures."""
        figures = self.figures[name]
        setup, settle = loop_setup(self.linear, name, held=name == "current"), self.settle[name]
        whole = settling_ticks_of(loop.plain_closed, setup.hold_ticks, self.design.name, LONGEST_STEP_TICKS)
        ever = settling_ticks_of(loop.plain_closed, setup.hold_ticks, self.design.name, EVER_TICKS)
        slowest, asked = ever / SETTLE_TIME_CONSTANTS, self._frequencies(name, loop)
        slow = is_slow(asked, self.design.controller.period_s, setup.base_ticks, ever)
        if slow and coarse(setup, slowest):
            setup = standing_setup(self.linear, name, held=name == "current")
        self.rigs[name] = setup
        transient = transient_of(setup, slowest) if slow else None
        if transient is not None and transient.settled:
            sweep = transient.sweep(self._frequencies(name, loop, LOWEST_OF_A_STEP))
        else:
            transient, sweep = None, stepped_sine(setup, asked, settle)
        measured = measure_figures(setup, sweep, settle, whole, slowest, transient)
        fine = measured.sweep
        if measured.cut:
            self.budget.cut.append(
                f"{name} loop: {measured.cut}: its share of {self.budget.seconds:g} s is used up"
            )
        tones = errors = None
        if transient is not None:
            self.notes.append(f"{name} loop: slow against its tick, measured by one long step, not by sines")
        elif self.settings.multisine and not measured.cut:
            with suppress(OutOfTime):  # it only confirms the sweep
                tones = tone_sweep(setup, sweep.frequency_hz, sweep.amplitude, settle)
                errors = sweep_errors(tones, loop)
        return LoopValidation(
            name=name,
            figures=figures,
            measured=measured,
            open_loop=linear_response(loop.plain_open, fine.frequency_hz),
            closed_loop=linear_response(loop.plain_closed, fine.frequency_hz),
            open_errors=sweep_errors(fine, loop),
            closed_errors=sweep_errors(fine, loop, "closed_loop"),
            tones=tones,
            tone_errors=errors,
            confirmed=(),
        )

    def _frequencies(self, name: str, loop: Loop, lowest: float = LOWEST) -> Floats:
        """From well below the lowest figure of the loop to near Nyquist, evenly on a logarithmic scale."""
        assert loop.period_s is not None
        top = HIGHEST / loop.period_s
        low = max(self._lowest(name), lowest * top)
        count = max(self.settings.frequencies, int(PER_DECADE * np.log10(top / low)))
        marks = np.outer(self._marks(name), ABOUT).ravel()
        return np.unique(
            np.concatenate([np.geomspace(low, top, count), marks[(marks > low) & (marks < top)]])
        )

    def _marks(self, name: str) -> list[float]:
        """Where the linear loop has figures, Hz: there a grid may miss a narrow dip or peak."""
        result = self.figures[name]
        marks = [m.frequency_hz for m in result.margins.phase_margins]
        if result.bandwidth is not None:
            band = result.bandwidth
            marks += [x for x in (band.minus3db_hz, band.minus90deg_hz, band.resonance_hz) if x]
        if result.peaks is not None:
            marks += [
                hertz(x) or 0.0 for x in (result.peaks.sensitivity_rad_s, result.peaks.complementary_rad_s)
            ]
        return [x for x in marks if x > 0.0]

    def _lowest(self, name: str) -> float:
        """Where the sweep of a loop begins, Hz."""
        result, period = self.figures[name], self.loops.present[name].period_s or 1.0
        marks = [0.1 / period]
        if result.margins.phase_margin is not None:
            marks.append(result.margins.phase_margin.frequency_hz)
        if result.bandwidth is not None:
            marks += [x for x in (result.bandwidth.minus3db_hz, result.bandwidth.minus90deg_hz) if x]
            marks += [result.bandwidth.resonance_hz] if result.bandwidth.resonance_hz > 0.0 else []
        return min(marks) / BELOW

    def _confirm(self) -> tuple[Confirmation, ...]:
        """All margins of loops and break points, searched for together."""
        questions: list[Question] = []
        for name, settle in self.settle.items():
            loop, margins = self._stage_loops()[name], self.figures[name].margins
            questions += stage_questions(
                standing_setup(self.linear, name, held=name == "current"), loop, margins, settle
            )
        if self.settle and len(self.settle) == len(self.figures):
            setups = {point: standing_setup(self.linear, point) for point in self._inner_points()}
            questions += point_questions(setups, self.loops, max(self.settle.values()), self._exact)
        return confirm_margins(questions)

    @cached_property
    def _exact(self) -> dict[str, ExactMargins]:
        """Borders of the whole loop at every break point where something drives the motor."""
        from actuator_lti.loops import exact_margins

        return {
            point: exact_margins(self.loops, point) for point in points_of(self.design) if point != "output"
        }

    def _inner_points(self) -> list[str]:
        """Break points whose loop differs from that of a stage: all but the outermost, and the output."""
        outermost = stages_of(self.design)[-1]
        own = loop_setup(self.linear, outermost).point
        return [point for point in points_of(self.design) if point not in ("output", own)] or [own]

    def _points(self, confirmed: tuple[Confirmation, ...]) -> dict[str, PointValidation]:
        """Sweeps at the break points with all other loops closed."""
        from actuator_lti.loops import periodic_loop

        result = {}
        for point in self._inner_points():
            own = tuple(item for item in confirmed if item.loop == point)
            sweep = errors = None
            if self.settings.point_frequencies:
                loop = self.loops.break_points[point]
                top = THIRD_OF_NYQUIST / (loop.period_s or 1.0)
                outermost = stages_of(self.design)[-1]
                asked = np.geomspace(self._lowest(outermost), top, self.settings.point_frequencies)
                sweep = stepped_sine(loop_setup(self.linear, point), asked, self.settle[outermost])
                errors = errors_beside(sweep, periodic_loop(self.loops, point))
            result[point] = PointValidation(point, sweep, errors, own)
        return result

    def _release(self, confirmed: tuple[Confirmation, ...]) -> tuple[AmplitudeMargin, ...]:
        setups: dict[str, LoopSetup] = {name: loop_setup(self.linear, name) for name in self.settle}
        return release_margins(setups, confirmed, self.settle)

    @cached_property
    def _commanded(self) -> LoopFigures:
        """Figures of the response to the command, with feed-forward and filters."""
        return loop_figures(self.loops.present["position"], self.loops.plain_response)

    @cached_property
    def _steered(self) -> Design:
        """The drive on the bench with its command filter; a faint command does not reach the profile."""
        filtered = replace(self.design.command, rate_rad_s=inf, acceleration_rad_s2=inf, jerk_rad_s3=inf)
        return replace(self.linear, command=filtered)

    def _answer(self) -> Sweep | None:
        """The response to the command at frequencies about its own figures."""
        from actuator_lti.loops import assemble_loops

        design, response = self._steered, self.loops.plain_response
        if response is None:
            return None
        # where it stands here, it has the slope of friction at rest, not that of its operating motion
        at = {} if may_stand(design) else self.at
        self.answer_loops = assemble_loops(self._model_steered, **at)
        system = self.answer_loops.plain_response
        base = every(design, stages_of(design)[-1]) if stages_of(design) else 1
        # feed-forward may cancel a slow mode of the loop, which the start moves all the same
        settle = max([settling_ticks_of(system, base, design.name), *self.settle.values()])
        top = HIGHEST / (base * design.controller.period_s)
        marks = [x for name in self.figures for x in self._marks(name)]
        marks += [1.0 / (2.0 * pi * design.command.filter_time_s)] if design.command.filter_time_s else []
        middle = [x for x in marks if x < 0.5 * top] or [0.05 * top]
        low = max(min(middle) / 3.0, LOWEST * top)
        asked = np.geomspace(low, min(3.0 * max(middle), top), ANSWERS)
        ever = self._answer_settles(system, base)
        hiding = ever > HIDING * LEAST_SAMPLES * base  # a slow transient in windows that are short beside it
        if hiding or is_slow(asked, design.controller.period_s, base, ever):
            sweep = command_step(design, asked, ever / SETTLE_TIME_CONSTANTS)
            if sweep is not None:
                return sweep
        return command_sweep(design, asked, settle)

    def _answer_settles(self, system: Any, base: int) -> int:
        """Ticks in which the response to the command settles, however many."""
        loops = self._stage_loops()
        own = [settling_ticks_of(system, base, self.design.name, EVER_TICKS)]
        for name in self.settle:
            held = loop_setup(self.linear, name).hold_ticks
            own.append(settling_ticks_of(loops[name].plain_closed, held, self.design.name, EVER_TICKS))
        return max(own)

    def _steady(self) -> Entry:
        bench = on_the_bench(self.design)  # its own friction, also where the loops stand without some of it
        return steady_entry(bench, on_the_bench(self.model), max(self.settle.values()))

    def _breakaway(self) -> Entry | None:
        return breakaway_entry(on_the_bench(self.design), on_the_bench(self.model))

    @cached_property
    def _model_steered(self) -> Design:
        filtered = replace(self.model.command, rate_rad_s=inf, acceleration_rad_s2=inf, jerk_rad_s3=inf)
        bench = on_its_stand(on_the_bench(self.model), self.design)
        return replace(bench, command=filtered)

    def _answered(self, sweep: Sweep | None) -> list[Entry]:
        """The worst point of the response to the command."""
        if sweep is None:
            return []
        system, design = self.answer_loops.plain_response, self.design
        base = every(design, stages_of(design)[-1]) if stages_of(design) else 1
        settle = self._answer_settles(system, base)
        return [command_entry(design, sweep, system, settle / SETTLE_TIME_CONSTANTS)]

    def _rest(self) -> tuple[RestSweep | None, RestSteps]:
        """Sines and steps from rest."""
        design, settle = self.design, self.settle["position"]
        part = min(design.validation.amplitude_fractions)
        band = self._commanded.bandwidth
        sweep = None
        if band is not None and self.loops.limiters:
            marks = [x for x in (band.minus3db_hz, band.minus90deg_hz) if x]
            top = 0.8 * HIGHEST / (self.loops.present["position"].period_s or 1.0)
            high = min(2.0 * max(marks, default=top), top)
            asked = np.geomspace(min(marks, default=high) / BELOW, high, self.settings.rest_frequencies)
            near = np.outer(marks, NEAR).ravel()  # the figures read from the sweep lie about there
            asked = np.sort(np.concatenate([asked, near[near < top]]))
            dry = design.friction.dry_Nm(0.0) > 0.0
            amplitude = free_amplitude(design, self.loops, asked, part)
            sweep = sweep_from_rest(design, asked, amplitude, settle, described=dry)
        loop = self.loops.present["position"]
        ever = settling_ticks_of(
            loop.plain_closed, loop_setup(self.linear, "position").hold_ticks, design.name, EVER_TICKS
        )
        return sweep, steps_from_rest(design, settle, ever / SETTLE_TIME_CONSTANTS)

    def _conditional(self) -> Conditional:
        slow = settling_ticks_of(
            self.loops.present["position"].plain_closed,
            loop_setup(self.linear, "position").hold_ticks,
            self.design.name,
            LONGEST_STEP_TICKS,
        )
        return conditional_stability(self.design, self.loops, slow, self._exact)

    def _counts(self) -> tuple[Counts, ...]:
        return counts_of(self.design, self.loops, self.settle["position"])

    def _others(self, stable: bool) -> tuple[Any, Any, Any]:
        """Large signals, friction effects, specification."""
        from analyses.friction_effects import friction_effects
        from analyses.large_signal import large_signals
        from analyses.specification import specification

        wanted = self.settings
        parts: dict[str, tuple[bool, Callable[[], Any]]] = {
            "large signals": (
                wanted.large_signals,
                lambda: large_signals(self.design, self.loops, counts=wanted.map_counts),
            ),
            "friction effects": (wanted.friction_effects, lambda: friction_effects(self.design, self.loops)),
            "specification": (wanted.specification, lambda: specification(self.design, self.loops)),
        }
        outcome = []
        for name, (asked, work) in parts.items():
            result = None
            if asked and stable:
                with self.timed(name):
                    result = self._within(0.5, name, work, None)
            outcome.append(result)
        return outcome[0], outcome[1], outcome[2]

    def _ledger(
        self,
        loops: dict[str, LoopValidation],
        points: dict[str, PointValidation],
        steps: RestSteps | None,
        sweep: RestSweep | None,
    ) -> list[Entry]:
        """All entries: loops, break points, from rest."""
        rows: list[Entry] = []
        for name, loop in loops.items():
            if name in self.held_by_friction:
                why = "stable only with the friction of two slopes that is left out here"
                rows.append(not_judged(name, "stability", "", None, None, why, "linear"))
            elif not loop.figures.stable:
                rows.append(unstable_entry(self.linear, name, loop.figures))
            elif loop.measured is None:
                rows.append(not_judged(name, "bandwidth", "Hz", None, None, loop.reason))
                rows += point_entries(name, loop.confirmed)
            else:
                errors = [x for x in (loop.open_errors, loop.closed_errors) if x is not None]
                words = self.rigs[name].condition
                rows += loop_entries(name, loop.figures, loop.measured, loop.confirmed, errors, words)
        for name, point in points.items():
            rows += point_entries(name, point.confirmed)
        if steps is not None:
            rows += rest_entries(self.design, self._commanded, steps, sweep)
        return rows


def _with_confirmations(loop: LoopValidation, confirmed: tuple[Confirmation, ...]) -> LoopValidation:
    return replace(loop, confirmed=confirmed)
