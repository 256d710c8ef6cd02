"""Dynamic stiffness over frequency: magnitude and phase in every state of the drive."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart, Values


class Series(TypedDict):
    """One state of the drive."""

    label: str
    size: Values
    phase_deg: Values


class Data(TypedDict):
    """Dynamic stiffness over frequency."""

    frequency_hz: list[float]
    series: list[Series]
    unit: str


def draw(data: Data) -> Chart:
    """Draw the two panels."""
    chart = Chart(width=style.WIDE, height=420.0)
    top, bottom = chart.column(1.2, 1.0)
    f = data["frequency_hz"]
    top.y.log, top.y.label = True, f"stiffness, {data['unit']}"
    for k, series in enumerate(data["series"]):
        top.curve(f, series["size"], series["label"], **style.series(k))
        bottom.curve(f, series["phase_deg"], series["label"], **style.series(k))
    bottom.y.label = "phase, deg"
    top.x.log = True
    style.frequency(bottom, f)
    style.phase_axis(bottom, [y for s in data["series"] for y in s["phase_deg"]])
    return chart
