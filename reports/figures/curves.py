"""Curves over a common kind of x: the plain figure for whatever has no form of its own.

Data: ``series`` of ``label``, ``x``, ``y`` (``style``: "line" or "points"); ``x_label``, ``y_label``;
optional ``x_log``, ``y_log``, ``levels`` (``y``, ``label``).
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart


def draw(data: dict[str, Any]) -> Chart:
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
