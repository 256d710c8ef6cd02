"""A simulated motion: position, speed, current and voltage, limits drawn and shaded where active.

Data: ``time_s``; ``panels``, each with ``label``, ``series`` of ``label``, ``values``; ``limit`` (or null),
``limit_label``; ``active`` [[from_s, to_s], ...] where the limiter acts.
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart, Panel


def draw(data: dict[str, Any]) -> Chart:
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


def _panel(panel: Panel, data: dict[str, Any], time: list[float], scale: float) -> None:
    """Draw the signals of one panel, its limit and the spans in which the limit acts."""
    for start, stop in data["active"]:
        words = f"{data['limit_label']} limit acts"
        panel.band_x(start * scale, stop * scale, words, colour=style.RED)
    # the command lies under the response: drawn last in the list, first on the paper
    for k, series in reversed(list(enumerate(data["series"]))):
        panel.curve(time, series["values"], series["label"], width=2.0 if k == 0 else 1.5, **style.series(k))
    _limit(panel, data)
    panel.y.label = data["label"]


def _limit(panel: Panel, data: dict[str, Any]) -> None:
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
