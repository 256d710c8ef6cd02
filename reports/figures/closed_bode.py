"""Closed-loop Bode figure with both bandwidths and the resonance.

Data: as `reports.figures.bode`, with ``bandwidth``: ``minus3db_hz``, ``minus90deg_hz``, ``resonance_hz``,
``resonance_db``, ``level_db`` (the -3 dB line), each number or null.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures import style
from reports.figures.bode import curves

SIZE = (5.2, 4.9)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the two panels and mark the bandwidths."""
    top, bottom = fig.subplots(2, 1, sharex=True)
    curves(data, top, bottom)
    style.bound(top, [y for s in data["series"] for y in s["magnitude_db"]], span=60.0, top_room=0.15)
    band = data["bandwidth"]
    level, corner, lag = band["level_db"], band["minus3db_hz"], band["minus90deg_hz"]
    if level is not None:
        top.axhline(level, color=style.MUTED, linewidth=0.9, linestyle=(0, (4, 2)))
    if corner is not None and level is not None:
        _mark(top, (corner, level), f"−3 dB\n{style.hertz(corner)}", (style.GREEN, "o"), data, below=True)
    bottom.axhline(-90.0, color=style.MUTED, linewidth=0.9, linestyle=(0, (4, 2)))
    if lag is not None:
        _mark(bottom, (lag, -90.0), f"−90°\n{style.hertz(lag)}", (style.PURPLE, "D"), data, below=True)
    if band["resonance_db"] is not None and band["resonance_hz"] and band["resonance_db"] > 0.05:
        height = band["resonance_db"] + (band.get("dc_db") or 0.0)
        words = f"peak {band['resonance_db']:.2f} dB\n{style.hertz(band['resonance_hz'])}"
        _mark(top, (band["resonance_hz"], height), words, (style.RED, "^"), data, below=False)
    if len(data["series"]) > 1:
        top.legend(loc="lower left")


def _mark(
    ax: Axes, at: tuple[float, float], words: str, look: tuple[str, str], data: dict[str, Any], below: bool
) -> None:
    """Put a marked point with its label."""
    colour, marker = look
    ax.plot([at[0]], [at[1]], marker=marker, markersize=5.5, color=colour, linestyle="none")
    style.tag(ax, words, at, data, below=below, left=True if below else None)
