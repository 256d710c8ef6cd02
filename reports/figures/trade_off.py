"""Bandwidth against phase margin: what tuning can trade."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from reports.figures import style
from reports.figures.style import Chart


class Point(TypedDict):
    """One tuning."""

    bandwidth_hz: float
    phase_margin_deg: float
    feasible: bool


class Data(TypedDict):
    """The curve, the required corner and the chosen point."""

    points: list[Point]
    chosen: NotRequired[Point | None]
    bandwidth_min_hz: NotRequired[float | None]
    phase_margin_min_deg: NotRequired[float | None]
    title: str


def draw(data: Data) -> Chart:
    """Draw the curve, the required corner and the chosen point."""
    chart = Chart(width=style.WIDE, height=350.0, title=data["title"])
    panel = chart.panel()
    points = data["points"]
    x, y = [p["bandwidth_hz"] for p in points], [p["phase_margin_deg"] for p in points]
    panel.curve(x, y, "best smallest phase margin, worst corner", colour=style.BLUE)
    kinds = (
        (True, "o", style.GREEN, "all other requirements met"),
        (False, "x", style.RED, "another requirement fails"),
    )
    for ok, marker, colour, label in kinds:
        chosen = [(a, b) for a, b, p in zip(x, y, points, strict=True) if p["feasible"] is ok]
        if chosen:
            xs, ys = zip(*chosen, strict=True)
            panel.points(xs, ys, label, marker=marker, colour=colour, size=7.0)
    required: style.Style = {"colour": style.RED, "width": 1.2, "dash": 1}
    band, margin, at = data.get("bandwidth_min_hz"), data.get("phase_margin_min_deg"), data.get("chosen")
    if band is not None:
        panel.x.see([band])
        panel.rule_x(band, label="required", **required)
    if margin is not None:
        panel.y.see([margin])
        panel.rule_y(margin, label="required", **required)
    if at is not None:
        look: style.Style = {"marker": "D", "size": 9.0, "colour": style.ORANGE}
        panel.points([at["bandwidth_hz"]], [at["phase_margin_deg"]], "tuned", **look)
    panel.x.label = "bandwidth of the position loop, Hz"
    panel.y.label = "smallest phase margin of all loops, deg"
    return chart
