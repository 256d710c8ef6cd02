"""Current of a duty over one period, and the winding's temperature."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel, Values


class Heating(TypedDict):
    """Rise of the winding from ambient."""

    time_s: list[float]
    temperature: Values
    limit: float | None


class Data(TypedDict):
    """One period of the motion."""

    time_s: list[float]
    current: Values
    rms: float
    continuous: float | None
    heating: Heating | None


def draw(data: Data) -> Chart:
    """Draw one panel, or two side by side."""
    chart = Chart(width=style.WIDE, height=320.0)
    panel = chart.panel(title="One period of the motion")
    last = data["time_s"][-1]
    scale = style.time_axis(panel, last)
    panel.curve([t * scale for t in data["time_s"]], data["current"], "current", **style.series(0))
    panel.rule_y(data["rms"], "rms of the duty", colour=style.BLUE, dash=1)
    panel.y.see([data["rms"]])
    if data["continuous"] is not None:
        panel.y.see([data["continuous"]])
        panel.rule_y(data["continuous"], "continuous", colour=style.RED, dash=2)
    panel.y.label = "current, A"
    panel.x.limits(0.0, last * scale)
    if data["heating"] is not None:
        _winding(chart.panel(title="Winding"), data["heating"])
    return chart


def _winding(panel: Panel, data: Heating) -> None:
    """Draw the rise from ambient."""
    scale = style.time_axis(panel, data["time_s"][-1])
    panel.curve([t * scale for t in data["time_s"]], data["temperature"], "winding", **style.series(1))
    if data["limit"] is not None:
        panel.y.see([data["limit"]])
        panel.rule_y(data["limit"], "limit", colour=style.RED, dash=1)
    panel.y.label = "winding, °C"
