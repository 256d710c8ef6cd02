"""Confidence regions of pairs of coefficients, in percent of their values.

Data: ``pairs`` of ``x_label``, ``y_label``, ``whole`` and ``random`` (each ``x``, ``y``), ``interval``
[half width x, half width y].
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from reports.figures import style

SIZE = (8.4, 3.2)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the pairs side by side."""
    axes = fig.subplots(1, len(data["pairs"]), squeeze=False)[0]
    for ax, pair in zip(axes, data["pairs"], strict=True):
        whole, random = pair["whole"], pair["random"]
        ax.fill(whole["x"], whole["y"], color=style.BLUE, alpha=0.15, linewidth=0)
        ax.plot(whole["x"], whole["y"], color=style.BLUE, label="95 % region, all errors")
        ax.plot(
            random["x"],
            random["y"],
            color=style.ORANGE,
            linestyle=style.DASHES[1],
            label="scatter of the runs only",
        )
        for sign in (-1.0, 1.0):
            ax.axvline(
                sign * pair["interval"][0], color=style.MUTED, linewidth=0.9, linestyle=style.DASHES[2]
            )
            ax.axhline(
                sign * pair["interval"][1], color=style.MUTED, linewidth=0.9, linestyle=style.DASHES[2]
            )
        ax.plot([0.0], [0.0], marker="+", markersize=9, color=style.INK, linestyle="none")
        ax.set_xlabel(pair["x_label"])
        ax.set_ylabel(pair["y_label"])
    handles, labels = axes[0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper left", ncols=2)
