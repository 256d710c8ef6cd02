"""Magnitudes of S and T with their peaks.

Data: ``frequency_hz``, ``s_db``, ``t_db``; ``s_peak`` and ``t_peak`` (``frequency_hz``, ``db``) or null;
``limit_db`` (a requirement on the peak of S) or null; ``nyquist_hz`` or null.
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart, Panel


def draw(data: dict[str, Any]) -> Chart:
    """Draw both magnitudes, the peaks and the limit."""
    chart = Chart(width=style.HALF, height=225.0, loop=data.get("loop", ""))
    panel = chart.panel()
    f = data["frequency_hz"]
    for k, (name, values, peak) in enumerate((("S", "s_db", "s_peak"), ("T", "t_db", "t_peak"))):
        colour = (style.ORANGE, style.BLUE)[k]
        panel.curve(f, data[values], _words(name, data.get(peak)), colour=colour, dash=k)
        at = (data.get(peak) or {}).get("frequency_hz")
        if at and f[0] <= at <= f[-1] * 1.001:
            panel.points([at], [data[peak]["db"]], marker="^", colour=colour, size=7.0, read=False)
    panel.rule_y(0.0, colour=style.INK)
    style.frequency(panel, f)
    panel.y.label = "magnitude, dB"
    style.bound(panel, [*data["s_db"], *data["t_db"]], span=45.0, top_room=0.12)
    if data.get("limit_db") is not None:
        _limit(panel, data["limit_db"])
    return chart


def _words(name: str, peak: dict[str, Any] | None) -> str:
    """Name a curve, with its peak where it has one."""
    if not peak or not peak["frequency_hz"] or peak["db"] < 0.005:
        return f"|{name}|, no peak"
    return f"|{name}|, peak {peak['db']:.2f} dB at {style.hertz(peak['frequency_hz'])}"


def _limit(panel: Panel, limit_db: float) -> None:
    """Draw the limit of a requirement."""
    low, high = panel.y.span()
    panel.y.limits(high=max(high, limit_db + 0.2 * (limit_db - low)))
    panel.rule_y(limit_db, f"limit of |S|: {limit_db:g} dB", colour=style.RED, width=1.2, dash=1)
