"""Open-loop Bode figures of several loops side by side, each in several forms."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.bode import Curves, curves
from reports.figures.style import Chart


class Panel(Curves):
    """One loop in several forms; see `reports.figures.bode`."""

    title: str


class Data(TypedDict):
    """One panel a loop."""

    panels: list[Panel]


def draw(data: Data) -> Chart:
    """Draw a column a loop."""
    chart = Chart(width=style.WIDE, height=400.0)
    for panel in data["panels"]:
        top, bottom = chart.column(1.0, 1.0, title=panel["title"])
        curves(panel, top, bottom)
        top.rule_y(0.0, colour=style.INK)
        bottom.rule_y(-180.0, colour=style.INK)
        style.bound(top, [y for s in panel["series"] for y in s["magnitude_db"]], span=120.0, top_room=0.06)
    return chart
