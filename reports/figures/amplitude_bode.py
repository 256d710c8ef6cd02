"""Closed-loop response at several amplitudes, and the bandwidths against amplitude."""

from __future__ import annotations

from typing import Literal, TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel, Values

MARKERS = "os^Dv<>"


class Response(TypedDict):
    """One amplitude, or the linear one."""

    gain_db: Values
    phase_deg: Values


class Series(Response):
    """A response with its name."""

    label: str


class Against(TypedDict):
    """Bandwidth against amplitude."""

    amplitude: list[float]
    minus3db_hz: Values
    minus90deg_hz: Values
    linear_minus3db_hz: float | None
    linear_minus90deg_hz: float | None
    unit: str
    full: float


class Data(TypedDict):
    """Responses over frequency."""

    frequency_hz: list[float]
    series: list[Series]
    linear: Response
    against: Against


def draw(data: Data) -> Chart:
    """Draw gain and phase on the left, bandwidth against amplitude on the right."""
    chart = Chart(width=style.WIDE, height=440.0)
    gain, phase = chart.column(1.0, 1.0, width=1.45, title="Output over command")
    _responses(gain, data, "gain_db")
    _responses(phase, data, "phase_deg")
    style.bound(gain, [v for s in data["series"] for v in s["gain_db"]], span=45.0, top_room=0.12)
    known = style.known(v for s in (*data["series"], data["linear"]) for v in s["phase_deg"])
    style.phase_axis(phase, [max(v, -360.0) for v in known])
    gain.rule_y(-3.0103, dash=1)
    phase.rule_y(-90.0, dash=1)
    style.frequency(phase, data["frequency_hz"])
    gain.y.label, phase.y.label = "gain of the fundamental, dB", "phase, deg"
    _bandwidths(chart.panel(title="Bandwidth against amplitude"), data["against"])
    return chart


def _responses(panel: Panel, data: Data, key: Literal["gain_db", "phase_deg"]) -> None:
    """Draw one quantity at all amplitudes over the linear one."""
    linear = {"colour": style.MUTED, "width": 4.2, "opacity": 0.45}
    panel.curve(data["frequency_hz"], data["linear"][key], "linear", **linear)
    for k, series in enumerate(data["series"]):
        look: style.Style = {**style.series(k), "marker": MARKERS[k % 7], "size": 4.4, "every": 6}
        panel.curve(data["frequency_hz"], series[key], series["label"], **look)


def _bandwidths(panel: Panel, data: Against) -> None:
    """Draw both bandwidths against amplitude, with the linear ones as levels."""
    pairs = (
        (data["minus3db_hz"], data["linear_minus3db_hz"], "−3 dB", style.GREEN, "o", 0),
        (data["minus90deg_hz"], data["linear_minus90deg_hz"], "−90°", style.PURPLE, "D", 1),
    )
    for values, level, label, colour, marker, dash in pairs:
        panel.curve(data["amplitude"], values, label, colour=colour, marker=marker, size=5.0, dash=dash)
        if level is not None:
            panel.y.see([level])
            panel.rule_y(level, f"linear {style.hertz(level)}", colour=colour, dash=2)
    panel.rule_x(data["full"], dash=2)
    panel.x.log = panel.y.log = True
    panel.x.label = f"command amplitude, {data['unit']} (dotted: full deflection)"
    panel.y.label = "frequency, Hz"
