"""Linear and measured frequency response of a loop over one another, with their differences."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from reports.charts import style
from reports.charts.style import Chart, Panel, Values
from reports.numbers import significant

LEAST = 1e-12  # errors below this are drawn there


class Response(TypedDict):
    """One response; the errors are magnitudes."""

    title: str
    linear_db: Values
    linear_deg: Values
    measured_db: Values
    measured_deg: Values
    error_db: Values
    error_deg: Values


class Data(TypedDict):
    """One column a response."""

    frequency_hz: list[float]
    valid_to_hz: float
    panels: list[Response]
    tolerance_db: float
    tolerance_deg: float
    title: NotRequired[str]


def draw(data: Data) -> Chart:
    """Draw one column a response: magnitude, phase, differences."""
    chart = Chart(width=style.WIDE, height=520.0)
    for part in data["panels"]:
        panels = chart.column(3, 3, 2, title=part["title"])
        _overlay(panels[0], data, part["linear_db"], part["measured_db"])
        _overlay(panels[1], data, part["linear_deg"], part["measured_deg"])
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


def _overlay(panel: Panel, data: Data, linear: Values, measured: Values) -> None:
    """Draw the linear line and the measured points."""
    f = data["frequency_hz"]
    panel.curve(f, linear, "linear loop", colour=style.BLUE)
    look: style.Style = {"size": 5.0, "hollow": True, "colour": style.ORANGE}
    panel.points(f, measured, "measured by injection", **look)


def _errors(panel: Panel, data: Data, part: Response) -> None:
    """Draw the magnitudes of the differences and their tolerances on a logarithmic scale."""
    f = data["frequency_hz"]
    both = (
        ("dB", part["error_db"], data["tolerance_db"], style.PURPLE, 0),
        ("deg", part["error_deg"], data["tolerance_deg"], style.GREEN, 1),
    )
    for unit, errors, allowed, colour, dash in both:
        values = [None if x is None else max(x, LEAST) for x in errors]
        panel.curve(f, values, f"difference, {unit}", colour=colour, dash=dash, width=1.5)
        panel.rule_y(
            allowed, label=f"allowed: {significant(allowed, 2)} {unit}", colour=colour, dash=4, width=1.3
        )
    panel.y.log = True
    panel.y.limits(1e-12, 10.0)
    panel.y.ticks = style.powers((-12, -9, -6, -3, 0))
