"""Bandwidth against phase margin: what tuning can trade.

Data: ``points`` of ``bandwidth_hz``, ``phase_margin_deg``, ``feasible``; ``chosen`` (a point or null);
``bandwidth_min_hz``, ``phase_margin_min_deg`` (numbers or null); ``title``.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from reports.figures import style

SIZE = (8.4, 3.8)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the curve, the required corner and the chosen point."""
    ax = fig.add_subplot()
    points = data["points"]
    x = [p["bandwidth_hz"] for p in points]
    y = [p["phase_margin_deg"] for p in points]
    ax.plot(x, y, color=style.BLUE, label="best smallest phase margin, worst corner")
    for ok, marker, colour, label in (
        (True, "o", style.GREEN, "all other requirements met"),
        (False, "x", style.RED, "another requirement fails"),
    ):
        chosen = [(a, b) for a, b, p in zip(x, y, points, strict=True) if p["feasible"] is ok]
        if chosen:
            ax.plot(*zip(*chosen, strict=True), marker=marker, color=colour, linestyle="none", label=label)
    if data.get("bandwidth_min_hz") is not None:
        ax.axvline(data["bandwidth_min_hz"], color=style.RED, linewidth=1.1, linestyle=(0, (5, 2)),
                   label="required")  # fmt: skip
    if data.get("phase_margin_min_deg") is not None:
        ax.axhline(data["phase_margin_min_deg"], color=style.RED, linewidth=1.1, linestyle=(0, (5, 2)))
    if data.get("chosen"):
        at = data["chosen"]
        ax.plot([at["bandwidth_hz"]], [at["phase_margin_deg"]], marker="D", markersize=8, color=style.ORANGE,
                linestyle="none", label="tuned")  # fmt: skip
    ax.set_xlabel("bandwidth of the position loop, Hz")
    ax.set_ylabel("smallest phase margin of all loops, deg")
    ax.set_title(data["title"])
    ax.legend()
