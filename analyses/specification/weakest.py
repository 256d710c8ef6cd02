"""The weakest point of a drive: its least margin over all views, against what is required or customary.

Margins of different kinds are ranked by how near they let L come to -1
(`actuator_lti.asked.quantities.reserve`), not by shares of decibels.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isinf, log10
from typing import Any

from actuator_lti.asked.quantities import CUSTOMARY, QUANTITIES, reserve
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import OperatingPoint
from actuator_lti.margins import StabilityMargins
from analyses.corners.run import Corners
from analyses.linear.loop_figures import LoopFigures
from analyses.linear.loop_survey import LoopSurvey, OperatingPointFigures


@dataclass(frozen=True)
class View:
    """The margins of a loop from one side."""

    place: str  # operating point, corner or that all loops are closed; empty: as it is judged
    loop: str  # its name; empty at a break point
    rotor: str  # of a current loop: ``"free"`` or ``"locked"``
    stable: bool | None
    figures: Mapping[str, float]  # by the names of `CUSTOMARY`; ``inf`` where nothing limits
    cut: str = ""  # the break point, with all other loops closed
    kind: OperatingPoint = "sliding"  # the operating point
    load_Nm: float = 0.0
    design: Design | None = None  # where it is not the nominal one: that of a corner
    found: LoopFigures | None = None  # the loop as it is there


@dataclass(frozen=True)
class WeakPoint:
    """One margin in one view."""

    view: View
    quantity: str  # empty where the loop is not stable
    value: float
    limit: float
    required: bool  # whether the limit is a requirement's; else it is the customary one
    reserve: float  # share of the limit, as distance of L from -1, that is left; negative beyond it


def weakest(survey: LoopSurvey, corners: Corners | None = None) -> WeakPoint | None:
    """The weakest point of a drive; ``None`` where no margin is known.

    >>> from actuator_lti import load_design
    >>> from analyses.linear.loop_survey import survey_loops
    >>> point = weakest(survey_loops(load_design("ilr33-amber")))
    >>> point.view.loop, point.quantity
    ('position', 'phase_margin')
    """
    points = [point for view in views(survey, corners) for point in _points(view, survey.design)]
    return min(points, key=lambda point: point.reserve, default=None)


def views(survey: LoopSurvey, corners: Corners | None = None) -> Iterator[View]:
    """Every view of a drive, the loops as they are judged first."""
    yield from _loops("", survey.figures)
    for name, point in survey.break_points.items():
        figures = {} if point.figures is None else dict(figures_of(point.figures.margins))
        if point.exact is not None and point.exact.stable:  # periodic: the fundamental alone is not all of it
            up, down = point.exact.gain_upper, point.exact.gain_lower
            figures["gain_margin"] = 20.0 * log10(min(up, 1.0 / down if down else inf))
        yield View("all loops closed", "", "", point.stable, figures, name, found=point.figures)
    for one in survey.operating_points:
        if one.kind != "describing-function":
            at = {"kind": one.kind, "load_Nm": one.load_Nm or 0.0, "design": one.design}
            yield from _loops(one.place, one.figures, **at)
    for corner in corners.corners[1:] if corners else ():
        place = corner.name.replace("worst ", "tolerances of the worst ", 1)
        yield from _loops(place, corner.figures, design=corner.design)


def _loops(place: str, loops: Mapping[str, LoopFigures], **at: Any) -> Iterator[View]:
    for name, one in reversed(list(loops.items())):  # of loops that are not stable the outermost is named
        seen = [(one.rotor, one.judged)]
        seen += [("locked", one.locked)] if one.locked is not None and one.held is None else []
        for rotor, found in seen:
            margins = found.margins
            yield View(place, name, rotor, margins.stable, figures_of(margins), found=found, **at)


def figures_of(margins: StabilityMargins) -> dict[str, float]:
    """The margins that custom limits, by name and size; those that there are."""
    return {name: abs(value) for name, value in _signed(margins).items()}


def _signed(margins: StabilityMargins) -> dict[str, float]:
    """As the margins are written: downwards, and of a lead, below zero."""
    found = {name: getattr(margins, QUANTITIES[name].reader.partition(".")[2]) for name in CUSTOMARY}
    return {name: float(value) for name, value in found.items() if value is not None}


def _points(view: View, design: Design) -> Iterator[WeakPoint]:
    if view.stable is False:
        yield WeakPoint(view, "", 0.0, 0.0, False, -inf)
    if view.stable is not True:
        return
    for name, value in view.figures.items():
        limit, required = limit_of(design, name, view)
        if not isinf(value):
            yield WeakPoint(view, name, value, limit, required, reserve(name, value, limit, value - limit))


def limit_of(design: Design, quantity: str, view: View) -> tuple[float, bool]:
    """The limit of a margin in a view; whether a requirement sets it, as it does of loops as judged."""
    limits = [
        item.minimum
        for item in design.requirements
        if item.quantity == quantity and item.loop in ("every", view.loop) and item.minimum
        if view.rotor in ("", item.rotor or "free")
    ]
    return (max(limits), True) if limits and not view.place else (CUSTOMARY[quantity], False)


@dataclass(frozen=True)
class Spread:
    """A margin of a loop over the operating points, with its sign, and where it is least in size."""

    least: float
    most: float
    where: str


def spread(
    points: Sequence[OperatingPointFigures], names: Iterable[str] = ("gain_margin", "phase_margin")
) -> dict[str, dict[str, Spread]]:
    """By loop and figure; of a loop that is stable at every operating point."""
    seen = [point for point in points if point.kind != "describing-function"]
    made: dict[str, dict[str, Spread]] = {}
    for loop in dict.fromkeys(name for point in points for name in point.figures):
        judged = [(at.place or "sliding", at.figures[loop].judged) for at in seen if loop in at.figures]
        if not all(one.stable for _, one in judged):
            continue
        rows = [(place, _signed(one.margins)) for place, one in judged]
        for name in names:
            values = [(figures[name], place) for place, figures in rows if name in figures]
            if values:
                least, most = min(values, key=lambda v: abs(v[0])), max(values, key=lambda v: abs(v[0]))
                made.setdefault(loop, {})[name] = Spread(least[0], most[0], least[1])
    return made
