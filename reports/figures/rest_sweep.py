"""Command to output from rest: measured, the sliding loop, and the describing function of dry friction.

Data: ``frequency_hz``; ``series``, each ``label``, ``magnitude_db``, ``phase_deg``, ``points`` (bool).
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures import style

SIZE = (8.4, 5.6)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw magnitude, phase, and how far each line lies from the measurement."""
    top, bottom, off = fig.subplots(3, 1, sharex=True, height_ratios=(3, 3, 2))
    for k, series in enumerate(data["series"]):
        look: dict[str, Any] = {"color": style.SERIES[k % 7]}
        if series["points"]:
            look |= {"marker": "o", "markersize": 4.5, "linestyle": "none", "markerfacecolor": "none"}
        else:
            look |= {"linestyle": style.DASHES[k % 7]}
        top.plot(data["frequency_hz"], style.gaps(series["magnitude_db"]), label=series["label"], **look)
        bottom.plot(data["frequency_hz"], style.gaps(series["phase_deg"]), **look)
    style.phase_ticks(bottom, *bottom.get_ylim())
    _differences(off, data)
    style.log_frequency(off)
    top.set_ylabel("magnitude, dB")
    bottom.set_ylabel("phase, deg")
    top.legend(loc="lower left")


def _differences(ax: Axes, data: dict[str, Any]) -> None:
    """Draw each line less the measurement, in dB."""
    measured = next(series for series in data["series"] if series["points"])
    for k, series in enumerate(data["series"]):
        if series["points"]:
            continue
        pairs = zip(style.gaps(series["magnitude_db"]), style.gaps(measured["magnitude_db"]), strict=True)
        look = {"color": style.SERIES[k % 7], "linestyle": style.DASHES[k % 7]}
        ax.plot(data["frequency_hz"], [a - b for a, b in pairs], **look)
    ax.axhline(0.0, color=style.MUTED, linewidth=0.8)
    ax.set_ylabel("line less\nmeasured, dB")
