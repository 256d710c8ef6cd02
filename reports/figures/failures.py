"""Deflection and moment over time after each failure."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart, Values


class Series(TypedDict):
    """After one failure."""

    label: str
    time_s: list[float]
    deflection: Values
    moment: Values


class Data(TypedDict):
    """Every failure on one time axis."""

    series: list[Series]
    unit: str
    load: str
    stop: float
    detection_s: float


def draw(data: Data) -> Chart:
    """Draw the two panels on one time axis."""
    chart = Chart(width=style.WIDE, height=460.0, legend=True)
    top, bottom = chart.column(1.2, 1.0)
    last = max(series["time_s"][-1] for series in data["series"])
    scale, _ = style.time_unit(last)
    for k, series in enumerate(data["series"]):
        time = [t * scale for t in series["time_s"]]
        top.curve(time, series["deflection"], series["label"], **style.series(k))
        bottom.curve(time, series["moment"], series["label"], **style.series(k))
    top.rule_y(data["stop"], "stop", colour=style.RED, dash=1)
    top.y.see([data["stop"]])
    for panel in (top, bottom):
        panel.rule_x(data["detection_s"] * scale, "detected" if panel is top else "")
    top.y.label, bottom.y.label = f"deflection, {data['unit']}", f"moment, {data['load']}"
    style.time_axis(bottom, last)
    bottom.x.limits(0.0, last * scale)
    return chart
