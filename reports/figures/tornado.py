"""Tornado chart: which parameter moves a figure, and how far.

Data: ``label``, ``unit``, ``base``; ``bars``, largest first, each ``label``, ``low``, ``high`` (the figure
with the parameter at its lower and upper end, or null); ``low_label``, ``high_label``; ``limit`` or null.
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart

MOST = 10


def draw(data: dict[str, Any]) -> Chart:
    """Draw the bars on both sides of the base value."""
    bars, base = data["bars"][:MOST], data["base"]
    chart = Chart(width=style.WIDE, height=90.0 + 27.0 * len(bars), legend=True)
    panel = chart.panel()
    looks: tuple[tuple[str, dict[str, Any]], ...] = (
        ("low", {"colour": style.ORANGE, "fill": "none", "hatch": "//", "width": 1.2}),
        ("high", {"colour": style.BLUE}),
    )
    for k, bar in enumerate(bars):
        for end, look in looks:
            if bar[end] is not None:
                panel.bar(float(k), base, bar[end], data[f"{end}_label"], **look)
    panel.rule_x(base, colour=style.INK, width=1.3)
    if data.get("limit") is not None:
        panel.x.see([data["limit"]])
        panel.rule_x(data["limit"], "limit", colour=style.RED, width=1.4, dash=1)
    panel.y.ticks = [(float(k), bar["label"]) for k, bar in enumerate(bars)]
    panel.y.limits(-0.6, max(len(bars), 1) - 0.4)
    panel.y.reversed, panel.y.grid = True, False
    panel.x.label = f"{data['label']}, {data['unit']}" if data["unit"] else data["label"]
    return chart
