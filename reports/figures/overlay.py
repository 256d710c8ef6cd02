"""Responses of several designs over one another."""

from __future__ import annotations

from typing import Literal, TypedDict

from reports.figures import style
from reports.figures.style import Chart, Values


class Bode(TypedDict):
    """One design."""

    label: str
    frequency_hz: list[float]
    magnitude_db: Values
    phase_deg: Values


class Step(TypedDict):
    """One design."""

    label: str
    time_s: list[float]
    response: Values


class BodeData(TypedDict):
    """Frequency responses; the first is the base."""

    kind: Literal["bode"]
    series: list[Bode]
    title: str


class StepData(TypedDict):
    """Step responses; the first is the base."""

    kind: Literal["step"]
    series: list[Step]
    title: str


Data = BodeData | StepData


def draw(data: Data) -> Chart:
    """Draw the curves; the first series is the base and stands out."""
    chart = Chart(width=style.WIDE, height=410.0, title=data["title"])
    if data["kind"] == "step":
        _step(data, chart)
    else:
        _bode(data, chart)
    return chart


def _look(k: int) -> style.Style:
    colour = style.INK if k == 0 else style.SERIES[(k - 1) % 7]
    return {"colour": colour, "dash": k % 7, "width": 2.4 if k == 0 else 1.7}


def _bode(data: BodeData, chart: Chart) -> None:
    """Draw magnitude and phase."""
    top, bottom = chart.column(1.0, 1.0)
    for k, series in enumerate(data["series"]):
        top.curve(series["frequency_hz"], series["magnitude_db"], series["label"], **_look(k))
        bottom.curve(series["frequency_hz"], series["phase_deg"], series["label"], **_look(k))
    style.bound(top, [y for s in data["series"] for y in s["magnitude_db"]], span=70.0, top_room=0.1)
    style.phase_axis(bottom, [y for s in data["series"] for y in s["phase_deg"]], span=450.0, room=0.05)
    style.frequency(bottom)
    bottom.x.limits(*_ends(data["series"]))
    top.y.label, bottom.y.label = "magnitude, dB", "phase, deg"


def _step(data: StepData, chart: Chart) -> None:
    """Draw the step responses."""
    panel = chart.panel()
    scale = style.time_axis(panel, max(series["time_s"][-1] for series in data["series"]))
    for k, series in enumerate(data["series"]):
        panel.curve([t * scale for t in series["time_s"]], series["response"], series["label"], **_look(k))
    panel.x.limits(0.0)
    panel.y.label = "response to a unit step"


def _ends(series: list[Bode]) -> tuple[float, float]:
    return min(s["frequency_hz"][0] for s in series), max(s["frequency_hz"][-1] for s in series)
