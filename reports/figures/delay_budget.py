"""Where the phase at each crossover goes: one stacked bar a loop.

Data: ``bars`` of ``label`` and ``parts`` (``name``, ``deg``, all counted as lag); ``margins`` (deg) per bar.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures import style

SIZE = (10.6, 2.7)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw lag to the right and lead to the left of zero; what is left to 180 deg is phase margin."""
    ax = fig.add_subplot()
    names = list(dict.fromkeys(part["name"] for bar in data["bars"] for part in bar["parts"]))
    for row, bar in enumerate(data["bars"]):
        _bar(ax, row, bar["parts"], names)
    for k, name in enumerate(names):
        ax.barh([0], [0], **_look(k), label=name)
    ax.axvline(180.0, color=style.INK, linewidth=1.1)
    ax.axvline(0.0, color=style.INK, linewidth=0.9)
    ax.set_yticks(range(len(data["bars"])), [bar["label"] for bar in data["bars"]])
    ax.invert_yaxis()
    ax.xaxis.set_major_locator(style.multiples(30.0))
    ax.set_xlabel("lag at the gain crossover, deg (left of zero: lead; at 180 deg no phase margin is left)")
    ax.grid(visible=False, axis="y")
    fig.legend(loc="outside upper center", ncols=6)


def _bar(ax: Axes, row: int, parts: list[dict[str, Any]], names: list[str]) -> None:
    """Draw the parts of one loop and their sum."""
    ends = {1: 0.0, -1: 0.0}
    for part in parts:
        side = 1 if part["deg"] >= 0 else -1
        ax.barh(row, part["deg"], left=ends[side], height=0.56, **_look(names.index(part["name"])))
        if abs(part["deg"]) > 6:
            place: dict[str, Any] = {"ha": "center", "va": "center", "bbox": style.label_box()}
            ax.text(ends[side] + part["deg"] / 2, row, f"{part['deg']:.0f}°".replace("-", "−"), **place)
        ends[side] += part["deg"]
    ax.text(ends[1] + 2, row, f"{sum(ends.values()):.1f}° in all", va="center", color=style.INK)


def _look(k: int) -> dict[str, Any]:
    return {
        "color": style.SERIES[k % 7],
        "hatch": style.HATCHES[k % 7],
        "edgecolor": style.PAPER,
        "alpha": 0.85,
    }
