"""Bandwidth against phase margin: what tuning can trade.

Data: ``points`` of ``bandwidth_hz``, ``phase_margin_deg``, ``feasible``; ``chosen`` (a point or null);
``bandwidth_min_hz``, ``phase_margin_min_deg`` (numbers or null); ``title``.
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart


def draw(data: dict[str, Any]) -> Chart:
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
    required: dict[str, Any] = {"label": "required", "colour": style.RED, "width": 1.2, "dash": 1}
    if data.get("bandwidth_min_hz") is not None:
        panel.x.see([data["bandwidth_min_hz"]])
        panel.rule_x(data["bandwidth_min_hz"], **required)
    if data.get("phase_margin_min_deg") is not None:
        panel.y.see([data["phase_margin_min_deg"]])
        panel.rule_y(data["phase_margin_min_deg"], **required)
    if data.get("chosen"):
        at = data["chosen"]
        look: dict[str, Any] = {"marker": "D", "size": 9.0, "colour": style.ORANGE}
        panel.points([at["bandwidth_hz"]], [at["phase_margin_deg"]], "tuned", **look)
    panel.x.label = "bandwidth of the position loop, Hz"
    panel.y.label = "smallest phase margin of all loops, deg"
    return chart
