"""Closed-loop Bode figure with both bandwidths and the resonance."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from reports.figures import style
from reports.figures.bode import Curves, curves
from reports.figures.style import Chart, Panel


class Bandwidth(TypedDict):
    """What is marked; null where it is not known. ``level_db`` is the -3 dB line."""

    minus3db_hz: float | None
    minus90deg_hz: float | None
    resonance_hz: float | None
    resonance_db: float | None
    level_db: float | None
    dc_db: NotRequired[float | None]


class Data(Curves):
    """Curves of `reports.figures.bode`, with the bandwidths."""

    bandwidth: Bandwidth
    loop: NotRequired[str]


def draw(data: Data) -> Chart:
    """Draw the two panels and mark the bandwidths."""
    chart = Chart(width=style.HALF, height=410.0, loop=data.get("loop", ""))
    top, bottom = chart.column(1.0, 1.0)
    curves(data, top, bottom)
    style.bound(top, [y for s in data["series"] for y in s["magnitude_db"]], span=60.0, top_room=0.15)
    band = data["bandwidth"]
    level, corner, lag = band["level_db"], band["minus3db_hz"], band["minus90deg_hz"]
    if level is not None:
        top.rule_y(level, dash=1)
    if corner is not None and level is not None:
        _mark(top, (corner, level), f"−3 dB\n{style.hertz(corner)}", style.GREEN, "o")
    bottom.rule_y(-90.0, dash=1)
    if lag is not None:
        _mark(bottom, (lag, -90.0), f"−90°\n{style.hertz(lag)}", style.PURPLE, "D")
    if band["resonance_db"] is not None and band["resonance_hz"] and band["resonance_db"] > 0.05:
        height = band["resonance_db"] + (band.get("dc_db") or 0.0)
        words = f"peak {band['resonance_db']:.2f} dB\n{style.hertz(band['resonance_hz'])}"
        _mark(top, (band["resonance_hz"], height), words, style.RED, "^")
    return chart


def _mark(panel: Panel, at: tuple[float, float], words: str, colour: str, marker: str) -> None:
    """Put a marked point with its label."""
    panel.points([at[0]], [at[1]], colour=colour, marker=marker, size=6.5, read=False)
    panel.note(words, at)
