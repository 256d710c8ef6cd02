"""Lost motion by dry friction, and how long a step below the threshold waits."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel, Values


class Loop(TypedDict):
    """Error over a slow triangle of the command."""

    label: str
    command: list[float]
    error: list[float]


class Wait(TypedDict):
    """Time to the first motion."""

    label: str
    amplitude: list[float]
    predicted_ms: Values
    simulated_ms: Values


class Data(TypedDict):
    """Loops, and waits where there are any."""

    loops: list[Loop]
    waits: list[Wait]
    unit: str
    error_unit: str
    wait_unit: str


def draw(data: Data) -> Chart:
    """Draw the loops, and the waiting times where there are any."""
    chart = Chart(width=style.WIDE, height=330.0)
    panel = chart.panel(title="Position error over a slow triangle of the command")
    panel.by_point = True
    for k, loop in enumerate(data["loops"]):
        x, y = [*loop["command"], loop["command"][0]], [*loop["error"], loop["error"][0]]
        panel.curve(x, y, loop["label"], **style.series(k))
    panel.rule_y(0.0)
    panel.x.label, panel.y.label = f"command, {data['unit']}", f"output less command, {data['error_unit']}"
    if data["waits"]:
        _waits(chart.panel(title="Wait before a small step moves the output"), data)
    return chart


def _waits(panel: Panel, data: Data) -> None:
    """Draw the time until the output moves against the size of the step."""
    for k, wait in enumerate(data["waits"]):
        panel.curve(wait["amplitude"], wait["predicted_ms"], f"{wait['label']}: predicted", **style.series(k))
        look: style.Style = {"colour": style.SERIES[k % 7], "marker": "os^D"[k % 4], "size": 6.0}
        panel.points(wait["amplitude"], wait["simulated_ms"], f"{wait['label']}: simulated", **look)
    panel.x.log = panel.y.log = True
    panel.x.label, panel.y.label = f"step, {data['wait_unit']}", "time to first motion, ms"
