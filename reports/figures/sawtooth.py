"""The sawtooth: position, speed and current of a sine that is faster than the speed limit."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel, Values


class Load(TypedDict):
    """Motion under one load; ``current`` is null for a source of torque."""

    title: str
    time_s: list[float]
    reference: list[float]
    output: Values
    rate: Values
    command_rate: Values
    current: Values | None
    note: str


class Data(TypedDict):
    """A column a load."""

    columns: list[Load]
    rate_limit: float
    unit: str
    rate_unit: str


def draw(data: Data) -> Chart:
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


def _column(panels: list[Panel], column: Load, data: Data, *, named: bool) -> None:
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
        panels[2].curve(time, column["current"] or (), "motor current", colour=style.ORANGE)
        panels[2].y.label = "motor current, A"
    panels[-1].x.label = "time, s"
    panels[-1].x.limits(time[0], time[-1])
