"""Command to output from rest: measured, the sliding loop, and the describing function of dry friction.

Data: ``frequency_hz``; ``series``, each ``label``, ``magnitude_db``, ``phase_deg``, ``points`` (bool).
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from reports.figures import style

SIZE = (8.4, 4.4)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw magnitude and phase."""
    top, bottom = fig.subplots(2, 1, sharex=True)
    for k, series in enumerate(data["series"]):
        look: dict[str, Any] = {"color": style.SERIES[k % 7]}
        if series["points"]:
            look |= {"marker": "o", "markersize": 4.5, "linestyle": "none", "markerfacecolor": "none"}
        else:
            look |= {"linestyle": style.DASHES[k % 7]}
        top.plot(data["frequency_hz"], style.gaps(series["magnitude_db"]), label=series["label"], **look)
        bottom.plot(data["frequency_hz"], style.gaps(series["phase_deg"]), **look)
    style.phase_ticks(bottom, *bottom.get_ylim())
    style.log_frequency(bottom)
    top.set_ylabel("magnitude, dB")
    bottom.set_ylabel("phase, deg")
    top.legend(loc="lower left")
