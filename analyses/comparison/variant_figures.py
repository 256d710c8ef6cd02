"""The figures that variants are compared by, with their names, units and which way is better."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isnan, pi

from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.asked.quantities import LOOP_QUANTITIES, QUANTITIES, drive_cases
from actuator_lti.batch import Population
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.loops import Loops
from analyses.linear.loop_figures import LoopFigures
from analyses.specification.capability import drive_figures
from nonlinear.runs.trajectory import COMMAND_UNITS

Figures = Mapping[str, float | None]


@dataclass(frozen=True)
class FigureName:
    """A figure."""

    key: str
    label: str
    unit: str
    group: str  # ``"current"``, ``"velocity"``, ``"position"``, ``"drive"`` or ``"large"``
    better: int  # 1 where larger is better, -1 where smaller is, 0 where neither


def small_signal(design: Design, result: Mapping[str, LoopFigures]) -> dict[str, float | None]:
    """Linear figures of every loop and static figures at every load of the design."""
    figures: dict[str, float | None] = {}
    for loop, found in result.items():
        one = found.judged
        for name, quantity in LOOP_QUANTITIES.items():
            value = quantity.read(one) if one.stable or not quantity.closed else None
            figures[f"{loop}.{name}"] = None if value is None else float(value)
    for name, load in drive_cases(design.validation.loads_Nm):
        value = float(drive_figure(design, name, load))
        figures[f"drive.{name}@{load:g}"] = None if isnan(value) else value
    return figures


@dataclass(frozen=True)
class LargeSignal:
    """Large-signal figures, taken of every design at the same commands."""

    frequencies_hz: tuple[float, ...]  # where the largest linear amplitude is given
    # Step of full deflection
    deflection_rad: float
    duration_s: float
    loads_Nm: tuple[float, ...]

    @classmethod
    def plan(cls, base: Design) -> LargeSignal:
        """Choose commands from the base, so that all designs get the same."""
        rates = [drive_figures(base, load).output_rate_rad_s for load in base.validation.loads_Nm]
        slowest = min((rate for rate in rates if rate > 0.0), default=1.0)
        deflection = base.validation.full_deflection_rad
        duration = min(20.0, 0.5 + 2.0 * deflection / slowest)
        return cls((1.0, 5.0), deflection, duration, base.validation.loads_Nm)

    def figures(self, design: Design, loops: Loops) -> dict[str, float | None]:
        """Largest linear amplitudes, and the nonlinear step of full deflection at every load."""
        from actuator_lti.loops.limiters import onset
        from analyses.monte_carlo.task import StepCheck, step_columns

        shown = COMMAND_UNITS[design.axis, design.controller.outermost][1]
        figures: dict[str, float | None] = {}
        for frequency in self.frequencies_hz:
            try:
                amplitude = float(onset(loops, [2 * pi * frequency]).amplitude_rad[0])
            except InputError:
                continue  # beyond Nyquist of the position loop
            figures[f"large.onset@{frequency:g}"] = amplitude * shown
        for load in self.loads_Nm:
            step = StepCheck(self.deflection_rad, self.duration_s, load)
            columns = step_columns(step, Population(design, {}, 1))
            for name in ("rise_time", "overshoot", "settling_time", "peak_current"):
                value = float(columns[f"nonlinear.{name}"][0])
                figures[f"large.{name}@{load:g}"] = None if value != value else value
        return figures


def figure_names(all_figures: Sequence[Figures], design: Design) -> tuple[FigureName, ...]:
    """Names of all figures that occur, in the order in which they first do."""
    keys = dict.fromkeys(key for figures in all_figures for key in figures)
    return tuple(_name(key, design) for key in keys)


def _name(key: str, design: Design) -> FigureName:
    group, _, rest = key.partition(".")
    quantity, _, at = rest.partition("@")
    known = QUANTITIES.get(quantity)
    if known is not None:
        unit, better = known.unit_for(design.axis), int(known.better)
    else:  # of the large signal
        command = COMMAND_UNITS[design.axis, design.controller.outermost][0]
        unit, better = (command, 1) if quantity == "onset" else ("A", -1)
    words = quantity.replace("_", " ")
    if quantity == "onset":
        words, at = "linear up to", f"{at} Hz"
    elif known is not None and known.source == "stiffness":
        at = ""  # no load changes it
    elif at:
        at = f"{at} {'N' if design.axis == 'linear' else 'N m'}"
    label = f"{words} at {at}" if at else words
    return FigureName(key, label, "" if unit == "1" else unit, group, better)
