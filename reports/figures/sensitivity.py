"""Magnitudes of S and T with their peaks."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel, Values


class Peak(TypedDict):
    """Highest point."""

    frequency_hz: float | None
    db: float


class Data(TypedDict):
    """Magnitudes, their peaks, and a requirement on the peak of S."""

    frequency_hz: list[float]
    s_db: Values
    t_db: Values
    s_peak: NotRequired[Peak | None]
    t_peak: NotRequired[Peak | None]
    limit_db: NotRequired[float | None]
    loop: NotRequired[str]
    nyquist_hz: NotRequired[float | None]


def draw(data: Data) -> Chart:
    """Draw both magnitudes, the peaks and the limit."""
    chart = Chart(width=style.HALF, height=225.0, loop=data.get("loop", ""))
    panel = chart.panel()
    f = data["frequency_hz"]
    both = (("S", data["s_db"], data.get("s_peak")), ("T", data["t_db"], data.get("t_peak")))
    for k, (name, values, peak) in enumerate(both):
        colour = (style.ORANGE, style.BLUE)[k]
        panel.curve(f, values, _words(name, peak), colour=colour, dash=k)
        at = peak["frequency_hz"] if peak else None
        if peak and at and f[0] <= at <= f[-1] * 1.001:
            panel.points([at], [peak["db"]], marker="^", colour=colour, size=7.0, read=False)
    panel.rule_y(0.0, colour=style.INK)
    style.frequency(panel, f)
    panel.y.label = "magnitude, dB"
    style.bound(panel, [*data["s_db"], *data["t_db"]], span=45.0, top_room=0.12)
    limit_db = data.get("limit_db")
    if limit_db is not None:
        _limit(panel, limit_db)
    return chart


def _words(name: str, peak: Peak | None) -> str:
    """Name a curve, with its peak where it has one."""
    if not peak or not peak["frequency_hz"] or peak["db"] < 0.005:
        return f"|{name}|, no peak"
    return f"|{name}|, peak {peak['db']:.2f} dB at {style.hertz(peak['frequency_hz'])}"


def _limit(panel: Panel, limit_db: float) -> None:
    """Draw the limit of a requirement."""
    low, high = panel.y.span()
    panel.y.limits(high=max(high, limit_db + 0.2 * (limit_db - low)))
    panel.rule_y(limit_db, f"limit of |S|: {limit_db:g} dB", colour=style.RED, width=1.2, dash=1)
