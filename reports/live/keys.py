"""The keys of a design as sliders: value, unit, range, tolerance; those that stay fixed, and why.

How the row of the simulator follows from the keys is found by `nonlinear.export.trace` on `design_row`, as
for an export in C: the page interprets the same statements. Figures of the whole drive follow likewise, out
of `actuator_lti.asked.drive_figure`.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from actuator_lti.design.access import located, parameter_value, paths_of
from actuator_lti.design.field import Field, Structure
from actuator_lti.design.model import Design, Tolerance
from actuator_lti.design.writing import unit_as_stated
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree
from nonlinear.export.page import changes_figure, changes_row, figure_statements
from nonlinear.export.statement import Term
from nonlinear.export.trace import Tape, row_statements

Figure = tuple[str, float]  # of the whole drive: name, load in N m

SLIDER_FACTOR = 5.0  # a slider goes from a fifth of the value to five times it
UNUSED = "has no influence on the loops or the run that this page follows"
ZERO = "0 in this design: change it in the design file"
UNFOLLOWED = "enters through a function that this page does not have: change it in the design file"
RESAMPLED = "the law of the stage was made for this period and is not resampled"
LONGEST = 20.0  # control periods: the range of a time that is 0
WIDEST = {"rad": 0.01, "m": 1e-4}  # the range of a play that is 0
COUNTED = 10.0  # a whole number has at least this range


@dataclass(frozen=True, kw_only=True)
class Followed:
    """Keys with a slider, keys without, and statements from keys (``k[n]``: a free one) to row and figures.

    Figures of the whole drive that cannot be followed are left out.
    """

    free: list[Tree]
    fixed: list[Tree]
    lines: list[list[Term]]
    figures: dict[Figure, list[list[Term]]]


def followed(design: Design, figures: Iterable[Figure] = ()) -> Followed:
    """Follow every numeric key of a design into its row, and into some figures of the whole drive."""
    asked = tuple(dict.fromkeys(figures))
    paths = [path for path in paths_of(design) if not path.startswith("validation.")]
    reasons = {path: _reason(design, path, asked) for path in paths}
    free = [_slider(design, path) for path, why in reasons.items() if not why]
    fixed = [{**named(design, path), "why": why} for path, why in reasons.items() if why]
    values = {key["path"]: key["value"] for key in free}
    made = {each: figure_statements(design, values, *each) for each in asked}
    return Followed(
        free=free,
        fixed=fixed,
        lines=[each.data for each in row_statements(design, values, Tape(interpreted=True))],
        figures={name: [each.data for each in lines] for name, lines in made.items() if lines is not None},
    )


def _reason(design: Design, path: str, figures: Iterable[Figure]) -> str:
    value, own = parameter_value(design, path), design.controller.own_law
    if own is not None and path in ("control.period", f"control.{own[0]}.every"):
        return RESAMPLED
    if value == 0.0:
        if not (top := _top(design, path)):
            return ZERO
        try:
            design.with_values({path: 0.5 * top})
        except InputError as error:
            return error.message.partition(": ")[2]
    changes = changes_row(design, path)
    if changes is None:
        return UNFOLLOWED
    if changes or any(changes_figure(design, path, *each) for each in figures):
        return ""
    return UNUSED if value else ZERO


def _top(design: Design, path: str) -> float:
    """Give the upper end of the slider of a key that is 0: a share, a time, a play; 0 for anything else."""
    field, _ = located(design, path)
    unit = field.unit(Structure.of(design))
    if path == "coupling.play":
        return WIDEST[unit]
    if field.low < 0.0 or unit not in ("1", "s"):
        return 0.0
    return min(1.0 if unit == "1" else LONGEST * design.controller.period_s, field.high)


def named(design: Design, path: str) -> Tree:
    """Give path, value and unit as the design file writes them."""
    field, value = located(design, path)[0], parameter_value(design, path)
    unit, factor = unit_as_stated(design, path)
    about = {"path": path, "about": field.description, "value": value, "unit": "" if unit == "1" else unit}
    return {**about, "factor": factor, "whole": field.kind == "integer"}


def _slider(design: Design, path: str) -> Tree:
    """Give a key with the range of its slider and the band of its tolerance."""
    field, value = located(design, path)[0], parameter_value(design, path)
    low, high = _range(field, value, _top(design, path))
    known = design.parameters.get(path)
    return {
        **named(design, path),
        "low": max(low, field.low),
        "high": min(high, field.high),
        "least": field.low if math.isfinite(field.low) else None,
        "most": field.high if math.isfinite(field.high) else None,
        "allowed": field.allowed(field.unit(Structure.of(design))),
        "band": None if known is None or known.tolerance is None else _band(value, known.tolerance),
    }


def _range(field: Field, value: float, top: float) -> tuple[float, float]:
    """Give the ends of a slider: both signs of a value below 0, whole numbers from 1."""
    if field.kind == "integer":
        return max(1.0, math.ceil(value / SLIDER_FACTOR)), max(COUNTED, value * SLIDER_FACTOR)
    if value == 0.0:
        return 0.0, top
    if value < 0.0:
        return value * SLIDER_FACTOR, -value * SLIDER_FACTOR
    return value / SLIDER_FACTOR, value * SLIDER_FACTOR


def _band(value: float, tolerance: Tolerance) -> list[float]:
    width = tolerance.width * (1.0 if tolerance.kind == "uniform" else 2.0)
    return [max(value - width, tolerance.lower), min(value + width, tolerance.upper)]
