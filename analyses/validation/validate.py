"""Validate a design: every prediction checked by the simulator, and where the linear model stops holding."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, TypeVar

import numpy as np

from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.drive.profile import command_mean
from actuator_lti.errors import InputError, NumericalError, TooManyTicks
from actuator_lti.loops import assemble_loops
from actuator_lti.loops.assemble import loops_at
from actuator_lti.loops.limiters import onset
from actuator_lti.types import Progress
from analyses.friction_effects import friction_effects
from analyses.isolation import attempt
from analyses.large_signal.conditional import conditional_stability
from analyses.large_signal.from_rest import RestSweep, margins_by_amplitude, sweep_from_rest
from analyses.large_signal.result import large_signals
from analyses.large_signal.tones import settled_ticks
from analyses.limit_cycles.counts import counts_of
from analyses.linear.loop_figures import all_loop_figures, loop_figures
from analyses.motion.settling import settlings_of
from analyses.specification import specification
from analyses.validation.design_values import design_value_rows
from analyses.validation.in_time import bench_sweep, margin_shown, step_shown
from analyses.validation.places import Bench
from analyses.validation.result import Validation
from analyses.validation.row import Row
from analyses.validation.settings import FINDINGS, Settings
from analyses.validation.small_signal import Place, small_signal
from nonlinear.bench.operating_motion import on_the_bench

T = TypeVar("T")
U = TypeVar("U")
NEAR = (0.9, 0.95, 1.0, 1.05)
BELOW, HIGHEST = 20.0, 0.4  # of the sweep from rest: below its lowest figure; of the sampling frequency
NO_POSITION = "a drive without a position loop: its loops are judged, motion from rest to an angle is not"


def validate(
    design: AnyDesign, settings: Settings | None = None, progress: Progress = None, *,
    model: Design | None = None,
) -> Validation:  # fmt: skip
    """Check every prediction of a design by the nonlinear simulator.

    ``settings``: which findings are looked for beside the checks; by default all.
    ``progress``: called with (parts done, parts in all).
    ``model``: drive that predictions are made of, by default the same: a wrong one shows what a validation
    sees.

    Raises `InputError`: if the design cannot be tested (no steady motion: dry friction takes the whole
    current, say). Raises `NumericalError`: from the computations.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> from analyses.validation import CHECKS
    >>> result = validate(load_design("ilr33-amber"), CHECKS)
    >>> result.passed, result.tally.not_proven
    (True, 0)
    """
    design, settings = as_design(design), settings or Settings()
    return _Work(design, settings, Bench(design, model or design), progress).run()


@dataclass
class _Work:
    """One validation under way."""

    design: Design
    settings: Settings
    bench: Bench
    progress: Progress
    notes: list[str] = field(default_factory=list)
    done: int = 0

    def run(self) -> Validation:
        self.total = len(self.bench.names) + 9
        rows, places = self._small_signals()
        stable = [name for name, own in self.bench.figures.items() if own.stable]
        loops = all_loop_figures(assemble_loops(self.bench.model), step=False, refused=self.notes)
        held = {name for name, own in loops.items() if own.held is not None}
        whole = {*stable, *held} >= {*self.bench.figures} and self.design.controller.position is not None
        if self.design.controller.position is None:
            self.notes.append(NO_POSITION)
        placed = [name for name in stable if name in places]
        swept = placed if "injected sweep" in self.settings.findings else []
        steps = self._each("step", stable, lambda name: step_shown(self.bench, name))
        margins = self._each("runs beside the margin", placed, lambda n: margin_shown(self.bench, places[n]))
        rows += [shown.row for shown in steps.values()]
        rows += [row for shown in margins.values() for row in shown.rows]
        values = partial(design_value_rows, self.design, self.bench.model)
        rows += self._part("numbers of the design", values, [])
        self._step()
        design, bench, settings = self.design, self.bench, self.settings
        settled = self._asked("rest after a step", whole, lambda: settlings_of(design, bench.commanded), ())
        return Validation(
            design=design,
            rows=tuple(rows),
            figures=bench.figures,
            loops=loops,
            steps=steps,
            margins=margins,
            sweeps=self._each("injected sweep", swept, lambda n: bench_sweep(bench, places[n])),
            amplitude_margins=self._asked("margins by amplitude", bool(stable),
                lambda: tuple(margins_by_amplitude(bench)), ()),
            conditional=self._asked("conditional stability", whole,
                lambda: conditional_stability(design, bench.commanded), None),
            settlings=settled,
            rest_sweep=self._asked("motion from rest", whole, self._rest, None),
            counts=self._asked("motion from rest", whole,
                lambda: counts_of(design, bench.commanded), ()),
            large_signals=self._asked("large signals", whole,
                lambda: large_signals(design, self._whole, counts=settings.map_counts), None),
            friction=self._asked("friction effects", whole,
                lambda: friction_effects(design, bench.commanded, settlings=settled), None),
            specification=self._asked("specification", whole,
                lambda: specification(design, bench.commanded), None),
            held_by_friction=self._held_by_friction(),
            notes=tuple(dict.fromkeys(self.notes)),
        )  # fmt: skip

    def _step(self) -> None:
        self.done += 1
        if self.progress is not None:
            self.progress(min(self.done, self.total), self.total)

    def _part(self, name: str, work: Callable[[], T], otherwise: U) -> T | U:
        """A part alone in its failure; what refuses the drive is noted."""

        def refused() -> T | U:
            try:
                return work()
            except (InputError, NumericalError, TooManyTicks) as error:
                self.notes.append(f"{name}: not done: {error}")
                return otherwise

        return attempt(name, refused, otherwise)

    def _each(self, what: str, names: list[str], work: Callable[[str], T | None]) -> dict[str, T]:
        """What is shown of some loops, without those of which there is nothing."""
        made = {name: self._part(f"{what} of the {name} loop", partial(work, name), None) for name in names}
        return {name: shown for name, shown in made.items() if shown is not None}

    def _asked(self, name: str, possible: bool, work: Callable[[], T], otherwise: U) -> T | U:
        """A finding, or what the drive itself does, if it is asked for."""
        wanted = name in self.settings.findings if name in FINDINGS else self.settings.own
        made = self._part(name, work, otherwise) if wanted and possible else otherwise
        self._step()
        return made

    def _small_signals(self) -> tuple[list[Row], dict[str, Place]]:
        """Rows of every place, and the places; of a break point that repeats a loop what that lacks."""
        rows = list[Row]()
        places: dict[str, Place] = {}
        self.bench.setup(self.bench.names[0])  # a drive without an operating motion cannot be tested
        for name in self.bench.names:
            place = self._part(f"tangent at {name}", partial(self.bench.place, name), None)
            if place is None:
                rows.append(_unproven(name, self.notes))
                continue
            places[name] = place
            made = self._part(f"checks at {name}", partial(small_signal, place), None)
            if made is not None and self.bench.repeats(name):
                made = [row for row in made if row.name == "delay_margin" or row.verdict is Verdict.NOT_MET]
            rows += [_unproven(name, self.notes)] if made is None else made
            self._step()
        every = (small_signal(place) for place in self.bench.onsets())
        onsets = self._part("checks at onsets", lambda: [row for rows in every for row in rows], None)
        rows += [_unproven("onsets", self.notes)] if onsets is None else onsets
        return rows, places

    def _held_by_friction(self) -> tuple[str, ...]:
        """Loops that are not stable as they are tested, but are with the friction that is left out there."""
        bench, model = self.bench, on_the_bench(self.bench.model)
        if bench.linear.friction == model.friction or all(own.stable for own in bench.figures.values()):
            return ()
        at = bench.setup(bench.names[0]).bias.operating(bench.drive)
        whole = assemble_loops(model, operating_point=at.point, speed_rad_s=at.speed_rad_s)
        figures = {name: loop_figures(loop, whole.plain_response) for name, loop in whole.present.items()}
        return tuple(name for name, own in figures.items() if own.stable and not bench.figures[name].stable)

    @cached_property
    def _whole(self) -> Any:
        """The same with the profile and the filter of the command in front."""
        loops = self.bench.commanded
        if self.bench.model.command == loops.design.command:
            return loops
        at = self.bench.setup("command").bias.operating(self.bench.drive)
        return loops_at(replace(self.bench.linear, command=self.bench.model.command), at)

    def _rest(self) -> RestSweep | None:
        """Sines from rest, about the bandwidth of the response to the command, feed-forward included."""
        design, mean = self.design, command_mean(self.bench.model)
        band = loop_figures(self._whole.present["position"], self._whole.plain_response, mean=mean).bandwidth
        if band is None or not self.bench.commanded.limiters:
            return None
        marks = [x for x in (band.minus3db_hz, band.minus90deg_hz) if x]
        top = HIGHEST / (self.bench.commanded.present["position"].period_s or 1.0)
        high = min(2.0 * max(marks, default=top), top)
        asked = np.geomspace(min(marks, default=high) / BELOW, high, self.settings.rest_frequencies)
        near = np.outer(marks, NEAR).ravel()
        asked = np.sort(np.concatenate([asked, near[near < top]]))
        part = min(design.validation.amplitude_fractions) * design.validation.full_deflection_rad
        limited = onset(self._whole, 2.0 * np.pi * asked).amplitude_rad
        return sweep_from_rest(
            design, asked, np.minimum(part, 0.5 * limited), settled_ticks(self.bench.commanded)
        )


def _unproven(name: str, notes: list[str]) -> Row:
    """The row of a place at which nothing could be measured."""
    because = [note for note in notes if f"at {name}:" in note] or ["it failed, see what is missing"]
    return Row(name="response", loop=name, verdict=Verdict.NOT_PROVEN, because=because[-1])
