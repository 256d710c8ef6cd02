"""The sawtooth: position, speed and current of a sine that is faster than the speed limit, a column a load.

Data: ``columns`` of ``title``, ``time_s``, ``reference``, ``output``, ``rate``, ``command_rate``,
``current`` (or null), ``note``; ``rate_limit``; ``unit``, ``rate_unit``.
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart, Panel


def draw(data: dict[str, Any]) -> Chart:
    """Draw the columns on common scales."""
    columns = data["columns"]
    rows = 3 if columns[0]["current"] is not None else 2
    chart = Chart(
        width=style.WIDE, height=160.0 + 130.0 * rows, title="Sawtooth: a sine faster than the rate limit"
    )
    highest = 1.15 * max(abs(v) for column in columns for v in column["reference"])
    currents = [abs(v) for column in columns for v in style.known(column["current"] or ())]
    ends = (highest, 1.5 * data["rate_limit"], 1.08 * max(currents, default=1.0))
    for k, column in enumerate(columns):
        panels = chart.column(1.5, *(1.0,) * (rows - 1), title=column["title"])
        _column(panels, column, data, named=k == 0)
        for panel, end in zip(panels, ends, strict=False):
            panel.y.limits(-end, end)
        panels[0].y.limits(high=2.6 * highest)  # room for the words
    return chart


def _column(panels: list[Panel], column: dict[str, Any], data: dict[str, Any], *, named: bool) -> None:
    """Draw one load."""
    time = column["time_s"]
    panels[0].curve(time, column["reference"], "command", colour=style.MUTED, dash=1)
    panels[0].curve(time, column["output"], "output", colour=style.BLUE)
    panels[0].y.label = f"position, {data['unit']}"
    panels[0].note(column["note"], corner="top left")
    panels[1].curve(time, column["command_rate"], "speed command", colour=style.MUTED, dash=1)
    panels[1].curve(time, column["rate"], "output rate", colour=style.GREEN)
    panels[1].y.label = f"rate, {data['rate_unit']}"
    for sign in (1.0, -1.0):
        words = "rate limit" if sign < 0 and named else ""
        panels[1].rule_y(sign * data["rate_limit"], words, colour=style.RED, width=1.1, dash=1)
    if len(panels) > 2:
        panels[2].curve(time, column["current"], "motor current", colour=style.ORANGE)
        panels[2].y.label = "motor current, A"
    panels[-1].x.label = "time, s"
    panels[-1].x.limits(time[0], time[-1])
