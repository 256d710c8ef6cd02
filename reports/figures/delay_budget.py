"""Where the phase at each crossover goes: one stacked bar a loop."""

from __future__ import annotations

from typing import TypedDict

from reports.charts.paint import HATCHES
from reports.figures import style
from reports.figures.style import Chart, Panel


class Part(TypedDict):
    """Part of the phase, counted as lag."""

    name: str
    deg: float


class Bar(TypedDict):
    """One loop."""

    label: str
    parts: list[Part]


class Data(TypedDict):
    """One bar a loop."""

    bars: list[Bar]


def draw(data: Data) -> Chart:
    """Draw lag to the right and lead to the left of zero; what is left to 180 deg is phase margin."""
    bars = data["bars"]
    chart = Chart(width=style.WIDE, height=70.0 + 48.0 * len(bars), legend=True)
    panel = chart.panel()
    names = list(dict.fromkeys(part["name"] for bar in bars for part in bar["parts"]))
    for row, bar in enumerate(bars):
        _bar(panel, row, bar["parts"], names)
    panel.rule_x(180.0, colour=style.INK, width=1.2)
    panel.rule_x(0.0, colour=style.INK)
    panel.y.ticks = [(float(k), bar["label"]) for k, bar in enumerate(bars)]
    panel.y.limits(-0.6, len(bars) - 0.4)
    panel.y.reversed, panel.y.grid = True, False
    low, high = panel.x.span()
    panel.x.limits(high=max(high * 1.13, 186.0))
    steps = range(int(low // 30), int(panel.x.span()[1] // 30) + 1)
    panel.x.ticks = [(30.0 * k, style.to_minus(f"{30 * k}")) for k in steps]
    panel.x.label = "lag at the gain crossover, deg (lead left of zero; at 180 deg no phase margin is left)"
    return chart


def _bar(panel: Panel, row: int, parts: list[Part], names: list[str]) -> None:
    """Draw the parts of one loop and their sum."""
    ends = {1: 0.0, -1: 0.0}
    for part in parts:
        side, k = (1 if part["deg"] >= 0 else -1), names.index(part["name"])
        start, stop = ends[side], ends[side] + part["deg"]
        look = {"colour": style.SERIES[k % 7], "hatch": HATCHES[k % 7]}
        panel.bar(float(row), start, stop, part["name"], **look)
        if abs(part["deg"]) > 8:
            panel.note(style.to_minus(f"{part['deg']:.0f}°"), ((start + stop) / 2, float(row)), pinned=True)
        ends[side] = stop
    panel.note(f"{sum(ends.values()):.1f}° in all", (ends[1], float(row)))
