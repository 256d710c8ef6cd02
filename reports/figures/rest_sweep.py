"""Command to output from rest: measured, the sliding loop, and the describing function of dry friction."""

from __future__ import annotations

from typing import TypedDict

from reports.charts import style
from reports.charts.style import Chart, Panel, Values


class Series(TypedDict):
    """Measured ``points``, or a line."""

    label: str
    magnitude_db: Values
    phase_deg: Values
    points: bool


class Data(TypedDict):
    """Command to output from rest."""

    frequency_hz: list[float]
    series: list[Series]


def draw(data: Data) -> Chart:
    """Draw magnitude, phase, and how far each line lies from the measurement."""
    chart = Chart(width=style.WIDE, height=500.0)
    top, bottom, off = chart.column(3, 3, 2)
    for k, series in enumerate(data["series"]):
        look: style.Style = style.series(k)
        if series["points"]:
            look = {"colour": style.SERIES[k % 7], "marker": "o", "size": 6.0, "hollow": True, "line": False}
        top.curve(data["frequency_hz"], series["magnitude_db"], series["label"], **look)
        bottom.curve(data["frequency_hz"], series["phase_deg"], series["label"], **look)
    style.phase_axis(bottom, [v for series in data["series"] for v in series["phase_deg"]])
    _differences(off, data)
    style.frequency(off)
    top.y.label, bottom.y.label = "magnitude, dB", "phase, deg"
    return chart


def _differences(panel: Panel, data: Data) -> None:
    """Draw each line less the measurement, in dB."""
    measured = next(series for series in data["series"] if series["points"])
    for k, series in enumerate(data["series"]):
        if not series["points"]:
            off = style.differences(series["magnitude_db"], measured["magnitude_db"])
            panel.curve(data["frequency_hz"], off, series["label"], **style.series(k))
    panel.rule_y(0.0)
    panel.y.label = "difference, dB"
