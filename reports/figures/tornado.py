"""Tornado chart: which parameter moves a figure, and how far.

Data: ``label``, ``unit``, ``base``; ``bars``, largest first, each ``label``, ``low``, ``high`` (the figure
with the parameter at its lower and upper end, or null); ``low_label``, ``high_label``; ``limit`` or null.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from reports.figures import style

SIZE = (8.4, 3.8)
MOST = 10


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the bars on both sides of the base value."""
    ax = fig.add_subplot()
    bars, base = data["bars"][:MOST], data["base"]
    for k, bar in enumerate(bars):
        looks = (("low", style.ORANGE, "////"), ("high", style.BLUE, ""))
        for end, colour, hatch in looks:
            value = bar[end]
            if value is None:
                continue
            face = (
                {"color": colour, "alpha": 0.85} if not hatch else {"facecolor": "none", "edgecolor": colour}
            )
            ax.barh(k, value - base, left=base, height=0.62, hatch=hatch, linewidth=1.0, **face)
    ax.axvline(base, color=style.INK, linewidth=1.2)
    if data.get("limit") is not None:
        ax.axvline(data["limit"], color=style.RED, linewidth=1.3, linestyle=(0, (5, 2)))
        ax.annotate("limit", (data["limit"], 1.0), xycoords=("data", "axes fraction"), color=style.RED,
                    xytext=(3, -2), textcoords="offset points", va="top")  # fmt: skip
    ax.set_yticks(range(len(bars)), [bar["label"] for bar in bars])
    ax.invert_yaxis()
    ax.grid(visible=False, axis="y")
    ax.set_xlabel(f"{data['label']}, {data['unit']}" if data["unit"] else data["label"])
    ax.margins(x=0.08)
    ax.barh(
        [0], [0], left=base, facecolor="none", edgecolor=style.ORANGE, hatch="////", label=data["low_label"]
    )
    ax.barh([0], [0], left=base, color=style.BLUE, alpha=0.85, label=data["high_label"])
    ax.legend(loc="lower right")
