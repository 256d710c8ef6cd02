"""One run of a campaign with its steady part marked."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart, Values


class Signal(TypedDict):
    """One signal."""

    label: str
    values: Values


class Data(TypedDict):
    """One run; ``window``: start and stop of its steady part, s."""

    time_s: list[float]
    panels: list[Signal]
    window: list[float]


def draw(data: Data) -> Chart:
    """Draw each signal in a panel of its own, the steady part shaded."""
    parts = data["panels"]
    chart = Chart(width=style.WIDE, height=60.0 + 120.0 * len(parts))
    panels = chart.column(*(1.0 for _ in parts))
    start, stop = data["window"]
    for k, (panel, part) in enumerate(zip(panels, parts, strict=True)):
        panel.curve(data["time_s"], part["values"], colour=style.SERIES[k % 7], width=1.1)
        panel.band_x(start, stop, colour=style.RED, opacity=0.1)
        for edge in (start, stop):
            panel.rule_x(edge, colour=style.RED, width=1.2, dash=1)
        panel.y.label = part["label"]
    panels[-1].x.label = "time, s"
    panels[-1].x.limits(data["time_s"][0], data["time_s"][-1])
    return chart
