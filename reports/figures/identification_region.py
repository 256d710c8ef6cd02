"""Confidence regions of pairs of coefficients, in percent of their values.

Data: ``pairs`` of ``x_label``, ``y_label``, ``whole`` and ``random`` (each ``x``, ``y``), ``interval``
[half width x, half width y].
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart


def draw(data: dict[str, Any]) -> Chart:
    """Draw the pairs side by side."""
    chart = Chart(width=style.WIDE, height=300.0)
    for pair in data["pairs"]:
        panel = chart.panel()
        panel.by_point = True
        whole, random = pair["whole"], pair["random"]
        panel.shape([(whole["x"], whole["y"])], colour=style.BLUE, opacity=0.15)
        panel.curve(whole["x"], whole["y"], "95 % region, all errors", colour=style.BLUE)
        panel.curve(random["x"], random["y"], "scatter of the runs only", colour=style.ORANGE, dash=1)
        for sign in (-1.0, 1.0):
            panel.rule_x(sign * pair["interval"][0], dash=2)
            panel.rule_y(sign * pair["interval"][1], dash=2)
        panel.points([0.0], [0.0], marker="+", size=10.0, colour=style.INK, read=False)
        panel.x.label, panel.y.label = pair["x_label"], pair["y_label"]
    return chart
