"""A signal measured and modelled, and the difference below."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart, Values


class Data(TypedDict):
    """A signal, its model and the difference; labels with units."""

    time_s: list[float]
    measured: Values
    modelled: Values
    difference: Values
    label: str
    difference_label: str


def draw(data: Data) -> Chart:
    """Draw both, and the difference."""
    chart = Chart(width=style.WIDE, height=380.0)
    upper, lower = chart.column(2.2, 1.0)
    upper.curve(data["time_s"], data["measured"], "measured", colour=style.BLUE)
    upper.curve(data["time_s"], data["modelled"], "model", colour=style.ORANGE, width=1.4, dash=1)
    upper.y.label = data["label"]
    lower.rule_y(0.0)
    lower.curve(data["time_s"], data["difference"], colour=style.RED, width=1.1)
    lower.y.label, lower.x.label = data["difference_label"], "time, s"
    lower.x.limits(data["time_s"][0], data["time_s"][-1])
    return chart
