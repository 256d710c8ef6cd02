"""A chart as data: columns of panels, each panel a list of items in the units of its axes.

Whoever draws a figure puts items into panels; `reports.charts.svg` writes them.  Nothing here draws.
A column is a picture of its own, so that columns stack where the screen is narrow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partialmethod
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Discriminator, Field, PlainValidator

from actuator_lti.files.reading import shown
from reports.charts.axis import Axis

COLOURS = {
    "ink": "#1f2933",
    "muted": "#66727f",
    "grid": "#dde2e7",
    "paper": "#fefefe",
    "c1": "#0072b2",
    "c2": "#c46200",
    "c3": "#00805f",
    "c4": "#8e4585",
    "c5": "#c0392b",
    "c6": "#3a8fc4",
    "c7": "#7a5c1e",
}
"""Those of Okabe and Ito: on a page its variables, with these as fallback, on paper these themselves."""

Values = Sequence[float | None] | Sequence[float] | np.ndarray


def numbers(values: Values) -> np.ndarray:
    """Turn plain values into floats; None is NaN, and what is none a ValueError."""
    try:
        return np.asarray(values, dtype=float)
    except TypeError as error:
        raise ValueError(str(error)) from None


def _read_colour(name: str) -> str:
    if name not in COLOURS and name not in ("", "none"):
        raise ValueError(f"{shown(name)}: allowed: {', '.join(COLOURS)}, none")
    return name


Numbers = Annotated[np.ndarray, PlainValidator(numbers)]
Colour = Annotated[str, AfterValidator(_read_colour)]  # a pen writes it as it stands
Length = Annotated[float, Field(gt=0.0, le=10_000.0)]  # ticks are as many as have room
Share = Annotated[float, Field(gt=0.0, le=1000.0)]
Way = Literal["x", "y"]


@dataclass(frozen=True, kw_only=True)
class Look:
    """How an item is painted; ``colour`` is a key of `COLOURS`."""

    colour: Colour = "c1"
    dash: int = 0
    width: float = 1.9
    opacity: float = 1.0
    marker: str = ""
    size: float = 5.0
    hollow: bool = False
    fill: Colour = ""
    hatch: str = ""


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A line, its points, or both; None and NaN are gaps. ``label`` puts it into the legend."""

    kind: Literal["curve"] = "curve"
    x: Numbers
    y: Numbers
    look: Look
    label: str = ""
    line: bool = True
    stairs: bool = False
    every: int = 1
    read: bool = True
    parameter: Numbers | None = None


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A closed outline: a bar, an area, a region."""

    kind: Literal["shape"] = "shape"
    rings: Sequence[tuple[Numbers, Numbers]]
    look: Look
    label: str = ""


@dataclass(frozen=True, kw_only=True)
class Rule:
    """A line across the whole panel, at an x or a y; ``words`` stand at its end, inside the frame."""

    kind: Literal["rule"] = "rule"
    at: float
    across: Way
    look: Look
    words: str = ""
    label: str = ""


@dataclass(frozen=True, kw_only=True)
class Band:
    """A stretch of an axis, over the whole panel."""

    kind: Literal["band"] = "band"
    low: float
    high: float
    across: Way
    look: Look
    label: str = ""


@dataclass(frozen=True, kw_only=True)
class Note:
    """Words near a point (kept off curves and inside the frame), or at a corner of the frame."""

    kind: Literal["note"] = "note"
    words: str
    at: tuple[float, float] | None = None
    corner: str = ""
    colour: Colour = "ink"
    bold: bool = False
    pinned: bool = False  # on the point itself in any case
    over: bool = False  # there where that is free


Item = Annotated[Curve | Shape | Rule | Band | Note, Discriminator("kind")]


@dataclass(kw_only=True)
class Panel:
    """Axes with what stands in them."""

    x: Axis = field(default_factory=Axis)
    y: Axis = field(default_factory=Axis)
    title: str = ""
    equal: bool = False
    by_point: bool = False
    items: list[Item] = field(default_factory=list)

    def curve(self, x: Values, y: Values, label: str = "", **options: Any) -> Curve:
        """Draw a line; options are those of `Curve` and `Look`."""
        own = {each.name: options.pop(each.name) for each in fields(Curve) if each.name in options}
        if own.get("parameter") is not None:
            own["parameter"] = numbers(own["parameter"])
        made = Curve(x=numbers(x), y=numbers(y), look=Look(**options), label=label, **own)
        self.x.see(made.x[np.isfinite(made.y)])
        self.y.see(made.y)
        self.items.append(made)
        return made

    def points(self, x: Values, y: Values, label: str = "", **options: Any) -> Curve:
        return self.curve(x, y, label, **{"marker": "o", "line": False, **options})

    def _rule(
        self, across: Way, at: float, words: str = "", label: str = "", *, seen: bool = False, **look: Any
    ) -> None:
        """Draw a line at an x or at a y; ``seen``: the axis reaches it."""
        getattr(self, across).see([at] if seen else [])
        painted = Look(**{"colour": "muted", "width": 1.0, **look})
        self.items.append(Rule(at=float(at), across=across, look=painted, words=words, label=label))

    rule_x = partialmethod(_rule, "x")
    rule_y = partialmethod(_rule, "y")

    def _band(self, across: Way, low: float, high: float, label: str = "", **look: Any) -> None:
        """Shade a stretch of x or of y."""
        self.items.append(Band(low=low, high=high, across=across, look=_shade(look), label=label))

    band_x = partialmethod(_band, "x")
    band_y = partialmethod(_band, "y")

    def shape(self, rings: Sequence[tuple[Values, Values]], label: str = "", **look: Any) -> None:
        made = [(numbers(x), numbers(y)) for x, y in rings]
        self.items.append(Shape(rings=made, look=_shade(look), label=label))

    def bar(self, row: float, start: float, stop: float, label: str = "", **look: Any) -> None:
        half = 0.3
        self.x.see([start, stop])
        self.y.see([row - 0.6, row + 0.6])
        ring = ([start, stop, stop, start], [row - half, row - half, row + half, row + half])
        self.shape([ring], label, **{"opacity": 0.85, **look})

    def note(self, words: str, at: tuple[float, float] | None = None, **options: Any) -> None:
        """Write near a point or, without one, into a corner such as ``"top left"``."""
        self.items.append(Note(words=words, at=at, **options))


@dataclass(kw_only=True)
class Column:
    """Panels one below the other; their x axes are one."""

    panels: list[Panel]
    heights: Sequence[Share]
    width: Share = 1.0
    title: str = ""

    def written(self) -> Column:
        """Give what a document has to hold of it: the x axis stands in the last panel."""
        return replace(self, panels=[replace(one, x=Axis()) for one in self.panels[:-1]] + self.panels[-1:])


@dataclass(kw_only=True)
class Chart:
    """Columns side by side, in the units of the view box (a page shows about one pixel for each)."""

    width: Length = 420.0
    height: Length = 300.0
    columns: list[Column] = field(default_factory=list)
    title: str = ""
    legend: bool | None = None
    legend_title: str = ""
    loop: str = ""

    def column(self, *heights: float, width: float = 1.0, title: str = "") -> list[Panel]:
        """Add a column with a panel for each height (one, without any) and give its panels."""
        sizes = heights or (1.0,)
        axis = Axis()
        panels = [Panel(x=axis) for _ in sizes]
        self.columns.append(Column(panels=panels, heights=sizes, width=width, title=title))
        return panels

    def panel(
        self, x: str = "", y: str = "", log: str = "", *, by_point: bool = False, **options: Any
    ) -> Panel:
        """Add a column of one panel: labels of its axes, and which of them are logarithmic (``"xy"``)."""
        made = self.column(**options)[0]
        made.x.label, made.y.label, made.by_point = x, y, by_point
        made.x.log, made.y.log = "x" in log, "y" in log
        return made

    def labels(self) -> list[tuple[str, Item]]:
        items = [one for column in self.columns for panel in column.panels for one in panel.items]
        named = [(one.label, one) for one in items if not isinstance(one, Note) and one.label]
        first = dict(reversed(named))
        return [(label, first[label]) for label in dict.fromkeys(label for label, _ in named)]


def _shade(look: Mapping[str, Any]) -> Look:
    """Fill with the colour, faintly, without an edge."""
    return Look(**{"fill": look.get("colour", "c1"), "opacity": 0.13, "width": 0.0, **look})
