"""The torque-speed plane of the motor: bounds, what steady motion needs, and paths of manoeuvres.

Motion backwards is turned by half a turn, so that torque below zero brakes.
"""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel, Values

BOUND_COLOURS = {
    "voltage limit": style.RED,
    "drive signal at its limit": style.RED,
    "peak current": style.ORANGE,
    "continuous current": style.BROWN,
    "speed limit": style.BLUE,
}


class Line(TypedDict):
    """A bound or a demand."""

    label: str
    speed: list[float]
    torque: list[float]


class Path(TypedDict):
    """Of a manoeuvre; a gap where it reverses."""

    label: str
    speed: list[float]
    torque: Values


class Data(TypedDict):
    """``fast`` and ``top``: speed and torque that the frame must show."""

    title: str
    bounds: list[Line]
    demands: list[Line]
    paths: list[Path]
    speed_label: str
    torque_label: str
    top: float
    fast: float


def draw(data: Data) -> Chart:
    """Draw bounds with their names on them, then demands and paths."""
    chart = Chart(width=style.WIDE, height=400.0, title=data["title"], legend=True)
    panel = chart.panel()
    panel.by_point = True
    panel.x.limits(-0.02 * data["fast"], data["fast"])
    panel.y.limits(-1.12 * data["top"], 1.25 * data["top"])
    panel.rule_y(0.0)
    for k, path in enumerate(data["paths"]):
        look: style.Style = {"colour": style.SERIES[(k + 2) % 7], "dash": k % 7, "width": 1.5}
        panel.curve(path["speed"], path["torque"], path["label"], **look)
    for bound in data["bounds"]:
        _bound(panel, bound, data)
    for k, demand in enumerate(data["demands"]):
        panel.curve(
            demand["speed"], demand["torque"], demand["label"], colour=style.INK, width=1.5, dash=2,
            marker="os^D"[k % 4], size=5.0, every=8,
        )  # fmt: skip
    panel.x.label, panel.y.label = data["speed_label"], data["torque_label"]
    return chart


def _bound(panel: Panel, bound: Line, data: Data) -> None:
    """Draw one bound in both halves, named once."""
    colour, speed, torque = BOUND_COLOURS.get(bound["label"], style.INK), bound["speed"], bound["torque"]
    upright = speed[0] == speed[-1]
    look: style.Style = {"colour": colour, "width": 1.3, "dash": 1}
    if upright:
        panel.rule_x(speed[0], bound["label"], **look)
        return
    panel.curve(speed, torque, read=False, **look)
    if torque[0] == torque[-1]:
        panel.curve(speed, [-t for t in torque], read=False, **look)
    inside = [
        (s, t)
        for s, t in zip(speed, torque, strict=True)
        if s < 0.97 * data["fast"] and t < 1.2 * data["top"]
    ]
    if inside:
        panel.note(bound["label"], inside[len(inside) // 2], colour=colour)
