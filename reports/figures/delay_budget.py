"""Where the phase at each crossover goes: one stacked bar a loop.

Data: ``bars`` of ``label`` and ``parts`` (``name``, ``deg``, all counted as lag); ``margins`` (deg) per bar.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from reports.figures import style

SIZE = (8.4, 2.9)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the bars from 0 to 180 deg of lag; what is left to 180 is the phase margin."""
    ax = fig.add_subplot()
    names = list(dict.fromkeys(part["name"] for bar in data["bars"] for part in bar["parts"]))
    for row, bar in enumerate(data["bars"]):
        start = 0.0
        for part in bar["parts"]:
            k = names.index(part["name"])
            look = {"color": style.SERIES[k % 7], "alpha": 0.85, "edgecolor": style.PAPER, "height": 0.56}
            ax.barh(row, part["deg"], left=start, hatch=style.HATCHES[k % 7], **look)
            if abs(part["deg"]) > 9:
                ax.text(
                    start + part["deg"] / 2,
                    row,
                    f"{part['deg']:.0f}°",
                    ha="center",
                    va="center",
                    bbox=style.label_box(),
                )
            start += part["deg"]
        ax.text(max(start, 0.0) + 2, row, f"{start:.1f}°", va="center", color=style.MUTED)
    for k, name in enumerate(names):
        ax.barh(
            [0], [0], color=style.SERIES[k % 7], hatch=style.HATCHES[k % 7], edgecolor=style.PAPER, label=name
        )
    ax.axvline(180.0, color=style.INK, linewidth=1.1)
    ax.set_yticks(range(len(data["bars"])), [bar["label"] for bar in data["bars"]])
    ax.invert_yaxis()
    ax.set_xticks(range(0, 181, 30))
    ax.set_xlabel("lag at the gain crossover, deg (180 deg: no phase margin left)")
    ax.grid(visible=False, axis="y")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, 1.28), ncols=min(len(names), 4))
