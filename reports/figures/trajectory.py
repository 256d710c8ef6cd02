"""A simulated motion: position, speed, current and voltage, limits drawn and shaded where active."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel, Values


class Signal(TypedDict):
    """One signal."""

    label: str
    values: Values


class Part(TypedDict):
    """Signals on one axis; ``active``: from when to when the limiter acts, s."""

    label: str
    series: list[Signal]
    limit: float | None
    limit_label: str
    active: list[list[float]]


class Data(TypedDict):
    """Panels on one time axis."""

    time_s: list[float]
    panels: list[Part]


def draw(data: Data) -> Chart:
    """Draw the panels one below the other on one time axis."""
    scale, _ = style.time_unit(data["time_s"][-1])
    chart = Chart(width=style.WIDE, height=60.0 + 150.0 * len(data["panels"]), legend=True)
    panels = chart.column(*(1.0 for _ in data["panels"]))
    time = [t * scale for t in data["time_s"]]
    for panel, part in zip(panels, data["panels"], strict=True):
        _panel(panel, part, time, scale)
    style.time_axis(panels[-1], data["time_s"][-1])
    panels[-1].x.limits(time[0], time[-1])
    return chart


def _panel(panel: Panel, data: Part, time: list[float], scale: float) -> None:
    """Draw the signals of one panel, its limit and the spans in which the limit acts."""
    for start, stop in data["active"]:
        words = f"{data['limit_label']} limit acts"
        panel.band_x(start * scale, stop * scale, words, colour=style.RED)
    # the command lies under the response: drawn last in the list, first on the paper
    for k, series in reversed(list(enumerate(data["series"]))):
        panel.curve(time, series["values"], series["label"], width=2.0 if k == 0 else 1.5, **style.series(k))
    _limit(panel, data)
    panel.y.label = data["label"]


def _limit(panel: Panel, data: Part) -> None:
    """Draw both signs of the limit where it lies within reach of the signals."""
    if data["limit"] is None:
        return
    peak = max((abs(v) for series in data["series"] for v in style.known(series["values"])), default=0.0)
    if data["limit"] > 4.0 * peak:
        panel.note(f"limit ±{data['limit']:.4g}, off scale", corner="top left", colour=style.MUTED)
        return
    panel.y.see([-data["limit"], data["limit"]])
    for sign in (1.0, -1.0):
        panel.rule_y(sign * data["limit"], colour=style.RED, width=1.2, dash=1)
