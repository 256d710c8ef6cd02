"""Lost motion by dry friction, and how long a step below the threshold waits.

Data: ``loops`` of ``label``, ``command``, ``error``; ``waits`` of ``label``, ``amplitude``,
``predicted_ms``, ``simulated_ms`` (may be empty); ``unit``, ``error_unit``, ``wait_unit``.
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart, Panel


def draw(data: dict[str, Any]) -> Chart:
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


def _waits(panel: Panel, data: dict[str, Any]) -> None:
    """Draw the time until the output moves against the size of the step."""
    for k, wait in enumerate(data["waits"]):
        panel.curve(wait["amplitude"], wait["predicted_ms"], f"{wait['label']}: predicted", **style.series(k))
        look: dict[str, Any] = {"colour": style.SERIES[k % 7], "marker": "os^D"[k % 4], "size": 6.0}
        panel.points(wait["amplitude"], wait["simulated_ms"], f"{wait['label']}: simulated", **look)
    panel.x.log = panel.y.log = True
    panel.x.label, panel.y.label = f"step, {data['wait_unit']}", "time to first motion, ms"
