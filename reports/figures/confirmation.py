"""How well margins are met in time, and how they move with amplitude and dry friction.

Data: ``margins``, each ``label``, ``difference`` (relative, magnitude); ``tolerance``; ``released``, each
``label``, ``sizes`` (names), ``with_friction`` and ``without`` (border over linear border, null: none found).
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from reports.figures import style

SIZE = (8.4, 4.4)
LEAST = 1e-9


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the differences on the left, the borders by amplitude on the right."""
    if not data["released"]:
        _differences(fig.add_subplot(), data)
        return
    left, right = fig.subplots(1, 2, width_ratios=(1, 1.15))
    _differences(left, data)
    _released(right, data)


def _differences(ax: Axes, data: dict[str, Any]) -> None:
    """One dot a margin."""
    labels = [item["label"] for item in data["margins"]]
    values = [max(item["difference"], LEAST) for item in data["margins"]]
    places = list(range(len(labels)))[::-1]
    ax.plot(values, places, marker="o", linestyle="none", color=style.BLUE, markersize=5)
    ax.axvline(data["tolerance"], color=style.RED, linestyle=(0, (5, 2)), linewidth=1.2)
    ax.text(
        data["tolerance"], len(labels) - 0.4, "allowed ", ha="right", va="bottom", color=style.RED, fontsize=8
    )
    ax.set_xscale("log")
    ax.set_xlim(LEAST / 2.0, 1e-1)
    ax.set_ylim(-0.6, len(labels) + 0.1)
    ax.set_yticks(places, labels)
    ax.set_xticks([1e-9, 1e-7, 1e-5, 1e-3, 1e-1])
    ax.xaxis.set_major_formatter(FuncFormatter(style.powers))
    ax.minorticks_off()
    ax.set_xlabel("difference from the linear margin, relative")
    ax.set_title("On a constant speed, no limit acting")


def _released(ax: Axes, data: dict[str, Any]) -> None:
    """Border over linear border for small, medium and large deviations."""
    for k, item in enumerate(data["released"]):
        x = [j + 0.06 * (k - len(data["released"]) / 2) for j in range(len(item["sizes"]))]
        look: dict[str, Any] = {"color": style.SERIES[k % 7], "markersize": 5.5}
        ax.plot(x, style.gaps(item["without"]), marker="o", label=item["label"], linewidth=1.2, **look)
        ax.plot(
            x, style.gaps(item["with_friction"]), marker="s", markerfacecolor="none", linewidth=1.2,
            linestyle=(0, (3, 2)), **look,
        )  # fmt: skip
    ax.axhline(1.0, color=style.MUTED, linewidth=0.9)
    ax.set_xticks(range(len(data["released"][0]["sizes"])), data["released"][0]["sizes"])
    ax.set_yscale("log")
    values = [x for item in data["released"] for key in ("without", "with_friction") for x in item[key] if x]
    ax.set_ylim(min([*values, 1.0]) / 1.3, max([*values, 1.0]) * 1.5)
    ticks = [t for t in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0) if ax.get_ylim()[0] <= t <= ax.get_ylim()[1]]
    ax.set_yticks(ticks, [f"{t:g}" for t in ticks])
    ax.minorticks_off()
    ax.set_xlabel("deviation that the drive is let go from")
    ax.set_ylabel("border over linear border")
    ax.set_title("From rest (dashed: dry friction)")
    ax.figure.legend(*ax.get_legend_handles_labels(), loc="outside lower right", ncols=3, fontsize=7.5)
