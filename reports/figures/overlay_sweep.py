"""Linear and measured frequency response of a loop over one another, with their differences.

Data: ``frequency_hz``, ``valid_to_hz``; ``panels``, each ``title`` with ``linear_db``, ``linear_deg``,
``measured_db``, ``measured_deg``, ``error_db``, ``error_deg`` (magnitudes); ``tolerance_db``,
``tolerance_deg``; ``title``.
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart, Panel

LEAST = 1e-12  # errors below this are drawn there


def draw(data: dict[str, Any]) -> Chart:
    """Draw one column a response: magnitude, phase, differences."""
    chart = Chart(width=style.WIDE, height=520.0)
    for part in data["panels"]:
        panels = chart.column(3, 3, 2, title=part["title"])
        _overlay(panels[0], data, part, "db")
        _overlay(panels[1], data, part, "deg")
        _errors(panels[2], data, part)
        style.bound(panels[0], part["linear_db"], span=90.0, top_room=0.1)
        style.phase_axis(panels[1], part["linear_deg"])
        for panel in panels:
            panel.rule_x(data["valid_to_hz"], dash=2)
        style.frequency(panels[2])
        labels = ("magnitude, dB", "phase, deg", "difference, dB and deg")
        for panel, label in zip(panels, labels, strict=True):
            panel.y.label = label
    return chart


def _overlay(panel: Panel, data: dict[str, Any], part: dict[str, Any], unit: str) -> None:
    """Draw the linear line and the measured points."""
    f = data["frequency_hz"]
    panel.curve(f, part[f"linear_{unit}"], "linear loop", colour=style.BLUE)
    look: dict[str, Any] = {"size": 5.0, "hollow": True, "colour": style.ORANGE}
    panel.points(f, part[f"measured_{unit}"], "measured by injection", **look)


def _errors(panel: Panel, data: dict[str, Any], part: dict[str, Any]) -> None:
    """Draw the magnitudes of the differences and their tolerances on a logarithmic scale."""
    f = data["frequency_hz"]
    for unit, colour, dash in (("dB", style.PURPLE, 0), ("deg", style.GREEN, 1)):
        key = unit.lower()
        values = [None if x is None else max(x, LEAST) for x in part[f"error_{key}"]]
        panel.curve(f, values, f"difference, {unit}", colour=colour, dash=dash, width=1.5)
        allowed = data[f"tolerance_{key}"]
        panel.rule_y(allowed, label=f"allowed: {allowed:g} {unit}", colour=colour, dash=4, width=1.3)
    panel.y.log = True
    panel.y.limits(1e-12, 10.0)
    panel.y.ticks = style.powers((-12, -9, -6, -3, 0))
