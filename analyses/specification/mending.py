"""The move that mends the weakest point of a drive: one gain, the least change, nothing else made worse."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, log
from typing import Any

import numpy as np

from actuator_lti.asked.quantities import CUSTOMARY, LOOP_QUANTITIES, reserve
from actuator_lti.batch import LinearFigures, Population, linear_figures
from actuator_lti.design import parameter_value
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.corners.run import Corners
from analyses.linear.loop_survey import LoopSurvey
from analyses.monte_carlo.judging import by_loop, in_populations, judge, loop_columns
from analyses.specification.weakest import View, WeakPoint, limit_of, views
from analyses.tuning.problem import GAINS, SPAN
from analyses.tuning.start import allowed_range

STEPS = 36  # on either side
HALVINGS = 6  # of the step to the first that mends
AT_ONCE = 12  # values


@dataclass(frozen=True)
class Move:
    """A gain, from what it is to where the weakest point is within its limit, SI."""

    path: str
    was: float
    value: float

    @property
    def change(self) -> float:
        """How far the gain goes, as a logarithm."""
        return abs(log(self.value / self.was))


def mending(point: WeakPoint, survey: LoopSurvey, corners: Corners | None = None) -> Move | None:
    """Find the least move of one gain that brings every margin of the weakest view within its limit.

    And those of every other view that is not stable: at the stability limit it would be no better.
    No other view of a loop goes beyond its limits, or further beyond them, and no requirement on a loop that
    is met is lost. ``None`` where no single gain within the factor `SPAN` does, or the view is no loop of
    `linear_figures`.

    >>> from actuator_lti import load_design
    >>> from analyses.linear.loop_survey import survey_loops
    >>> from analyses.specification.weakest import weakest
    >>> survey = survey_loops(load_design("ilr33-amber"))
    >>> mending(weakest(survey), survey).path
    'control.velocity.gain'
    """
    if not point.view.loop or point.view.rotor == "locked":
        return None
    others = [each for each in views(survey, corners) if each.loop and each.rotor != "locked"]
    mended = [[point.view], *_by_point(each for each in others if each.stable is False)]
    least: Move | None = None
    for path, was, end in _ways(survey.design):
        steps = np.geomspace(was, end, STEPS + 1)
        within = steps if least is None else steps[np.abs(np.log(steps / was)) < least.change]
        if not (first := _first(mended, survey.design, path, within)):
            continue
        before, value = steps[first - 1], steps[first]
        for _ in range(HALVINGS):
            middle = np.sqrt(before * value)
            if _first(mended, survey.design, path, np.array([middle])) is None:
                before = middle
            else:
                value = middle
        move = Move(path, was, _written(float(value), was))
        if (least is None or move.change < least.change) and _harmless(move, others, survey.design):
            least = move
    return least


def _ways(design: Design) -> Iterator[tuple[str, float, float]]:
    """Each gain, what it is, and how far it may go, down and up."""
    for path in GAINS:
        if path in design.parameters and (was := parameter_value(design, path)):
            low, high = allowed_range(design, path)
            yield path, was, max(was / SPAN, low)
            yield path, was, min(was * SPAN, high)


def _first(points: Sequence[Sequence[View]], design: Design, path: str, values: np.ndarray) -> int | None:
    """Which value is the first within the limits of all views; after one point each is asked by itself."""
    for start in range(0, len(values), AT_ONCE):
        some = values[start : start + AT_ONCE]
        for k in np.flatnonzero(_reserves(points[0], design, path, some).min(axis=0) >= 0.0):
            if all(_reserves(other, design, path, some[[k]]).min() >= 0.0 for other in points[1:]):
                return start + int(k)
    return None


def _by_point(views: Iterable[View]) -> list[list[View]]:
    """Views of one design at one operating point, together: their loops are figures of one population."""
    points: dict[Any, list[View]] = {}
    for view in views:
        points.setdefault((id(view.design), view.kind, view.load_Nm), []).append(view)
    return list(points.values())


def _written(value: float, was: float) -> float:
    """A value of three digits, away from what it was."""
    unit = 10.0 ** (np.floor(np.log10(abs(value))) - 2)
    return float(f"{unit * (np.ceil if value > was else np.floor)(value / unit * (1.0 - 1e-12)):.3g}")


def _reserves(same: Sequence[View], design: Design, path: str, values: np.ndarray) -> np.ndarray:
    """The least reserve of views of one point, (views, values of a gain); minus infinity where not stable."""
    at = {"operating_point": same[0].kind, "load_Nm": same[0].load_Nm}
    try:
        population = Population(same[0].design or design, {path: values}, len(values))
        loops = {view.loop for view in same}
        found = linear_figures(population, **at, time_figures=False, held=True, loops=loops)
    except InputError:
        return np.full((len(same), len(values)), -inf)
    return np.array([_least(found, view, design) for view in same])


def _least(found: LinearFigures, view: View, design: Design) -> np.ndarray:
    limits = {name: limit_of(design, name, view)[0] for name in CUSTOMARY}
    rows = zip(*(np.abs(found.quantity(name, view.loop)) for name in CUSTOMARY), strict=True)
    least = [
        min(reserve(name, x, limits[name], x - limits[name]) for name, x in zip(CUSTOMARY, row, strict=True))
        for row in rows
    ]
    return np.where(found.stable(view.loop), np.nan_to_num(least, nan=-inf), -inf)


def _harmless(move: Move, others: Iterable[View], design: Design) -> bool:
    """Whether no view goes further beyond its limits, and no requirement that is met is lost."""
    both = np.array([move.was, move.value])
    for same in _by_point(others):
        before, after = _reserves(same, design, move.path, both).T
        if np.any(after < np.minimum(before, 0.0)):
            return False
    found = linear_figures(Population(design, {move.path: both}, 2), time_figures=True, held=True)
    columns = loop_columns(found, design)
    for item in by_loop(design):
        if item.quantity in LOOP_QUANTITIES and item.loop in found.loops and in_populations(item, design):
            before, after = judge(item, design, columns).passed
            if before and not after:
                return False
    return True
