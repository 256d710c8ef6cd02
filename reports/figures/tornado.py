"""Tornado chart: which parameter moves a figure, and how far."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from reports.figures import style
from reports.figures.style import Chart

MOST = 10


class Bar(TypedDict):
    """The figure with a parameter at its lower and upper end."""

    label: str
    low: float | None
    high: float | None


class Data(TypedDict):
    """Largest first."""

    label: str
    unit: str
    base: float
    bars: list[Bar]
    low_label: str
    high_label: str
    limit: NotRequired[float | None]


def draw(data: Data) -> Chart:
    """Draw the bars on both sides of the base value."""
    bars, base = data["bars"][:MOST], data["base"]
    chart = Chart(width=style.WIDE, height=90.0 + 27.0 * len(bars), legend=True)
    panel = chart.panel()
    low: style.Style = {"colour": style.ORANGE, "fill": "none", "hatch": "//", "width": 1.2}
    for k, bar in enumerate(bars):
        if bar["low"] is not None:
            panel.bar(float(k), base, bar["low"], data["low_label"], **low)
        if bar["high"] is not None:
            panel.bar(float(k), base, bar["high"], data["high_label"], colour=style.BLUE)
    panel.rule_x(base, colour=style.INK, width=1.3)
    limit = data.get("limit")
    if limit is not None:
        panel.x.see([limit])
        panel.rule_x(limit, "limit", colour=style.RED, width=1.4, dash=1)
    panel.y.ticks = [(float(k), bar["label"]) for k, bar in enumerate(bars)]
    panel.y.limits(-0.6, max(len(bars), 1) - 0.4)
    panel.y.reversed, panel.y.grid = True, False
    panel.x.label = f"{data['label']}, {data['unit']}" if data["unit"] else data["label"]
    return chart
