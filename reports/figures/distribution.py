"""Distributions of figures with their limits, the nominal design and the worst case.

Data: ``panels``, at most three, each ``label``, ``unit``, ``edges``, ``counts``, ``nominal``, ``worst``,
``minimum``, ``maximum`` (numbers or null).
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reports.figures import style

SIZE = (8.4, 2.9)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw one histogram a panel."""
    panels = data["panels"]
    for ax, panel in zip(fig.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
        _histogram(ax, panel)
        _marks(ax, panel)
        ax.set_title(panel["label"])
        ax.set_xlabel(panel["unit"])
        ax.set_yticks([])
        ax.grid(visible=False)
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.24), ncols=3, columnspacing=0.9)


def _histogram(ax: Axes, panel: dict[str, Any]) -> None:
    """Fill the counts under a line."""
    edges, counts = panel["edges"], panel["counts"]
    if counts:
        ax.stairs(counts, edges, fill=True, color=style.SKY, alpha=0.45, linewidth=0)
        ax.stairs(counts, edges, color=style.BLUE, linewidth=1.2)
        ax.set_ylim(0, 1.15 * max(counts))
    ax.xaxis.set_major_locator(MaxNLocator(4))


def _marks(ax: Axes, panel: dict[str, Any]) -> None:
    """Mark limits, the nominal design and the worst case, each with its own dash."""
    known = [v for v in (panel["nominal"], panel["worst"]) if v is not None]
    low, high = min([*panel["edges"], *known], default=0.0), max([*panel["edges"], *known], default=1.0)
    reach = max(high - low, 1e-3 * max(abs(high), 1e-9))
    lines = [
        ("nominal", style.INK, "-"),
        ("worst", style.ORANGE, (0, (4, 2))),
        ("minimum", style.RED, (0, (1, 1.2))),
        ("maximum", style.RED, (0, (1, 1.2))),
    ]
    for name, colour, dash in lines:
        value = panel[name]
        if value is None:
            continue
        if name in ("minimum", "maximum") and not low - 2 * reach <= value <= high + 2 * reach:
            words = f"{name} {value:g} {panel['unit']}: off the scale"
            ax.text(
                0.03, 0.95, words, transform=ax.transAxes, va="top", color=style.RED, bbox=style.label_box()
            )
            continue
        label = "limit" if name in ("minimum", "maximum") else name
        ax.axvline(value, color=colour, linestyle=dash, linewidth=1.5, label=label)
