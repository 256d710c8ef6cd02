"""Curves over a common kind of x: the plain figure for whatever has no form of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NotRequired, TypedDict

from reports.figures import style
from reports.figures.style import Chart


class Series(TypedDict):
    """``style``: "line" (default) or "points"."""

    label: str
    x: Sequence[float | None]
    y: Sequence[float | None]
    style: NotRequired[str]


class Level(TypedDict):
    """A level to be kept."""

    y: float
    label: str


class Data(TypedDict):
    """Curves over a common kind of x."""

    series: list[Series]
    x_label: str
    y_label: str
    x_log: NotRequired[bool]
    y_log: NotRequired[bool]
    levels: NotRequired[list[Level]]


def draw(data: Data) -> Chart:
    """Draw the curves."""
    chart = Chart(width=style.WIDE, height=320.0)
    panel = chart.panel()
    panel.x.label, panel.y.label = data["x_label"], data["y_label"]
    panel.x.log, panel.y.log = bool(data.get("x_log")), bool(data.get("y_log"))
    for k, series in enumerate(data["series"]):
        if series.get("style") == "points":
            look = {"colour": style.SERIES[k % 7], "marker": "osD^v"[k % 5]}
            panel.points(series["x"], series["y"], series["label"], **look)
        else:
            panel.curve(series["x"], series["y"], series["label"], **style.series(k))
    for level in data.get("levels", ()):
        panel.y.see([level["y"]])
        panel.rule_y(level["y"], label=level["label"], colour=style.RED, width=1.2, dash=1)
    return chart
