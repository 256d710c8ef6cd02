"""Responses of several designs over one another.

Data: ``kind`` "bode" or "step"; ``series``, each ``label`` with ``frequency_hz``, ``magnitude_db``,
``phase_deg`` (bode) or ``time_s``, ``response`` (step); ``title``.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from reports.figures import style
from reports.numbers import time_unit

SIZE = (8.4, 4.6)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the curves; the first series is the base and stands out."""
    if data["kind"] == "step":
        _step(data, fig)
    else:
        _bode(data, fig)


def _look(k: int) -> dict[str, Any]:
    colour = style.INK if k == 0 else style.SERIES[(k - 1) % 7]
    return {"color": colour, "linestyle": style.DASHES[k % 7], "linewidth": 2.2 if k == 0 else 1.5}


def _bode(data: dict[str, Any], fig: Figure) -> None:
    """Draw magnitude and phase."""
    top, bottom = fig.subplots(2, 1, sharex=True)
    for k, series in enumerate(data["series"]):
        top.plot(
            series["frequency_hz"], style.gaps(series["magnitude_db"]), label=series["label"], **_look(k)
        )
        bottom.plot(series["frequency_hz"], style.gaps(series["phase_deg"]), **_look(k))
    style.bound(top, [y for s in data["series"] for y in s["magnitude_db"]], span=70.0, top_room=0.1)
    phases = [y for s in data["series"] for y in s["phase_deg"] if y is not None]
    style.bound(bottom, phases, span=450.0, top_room=0.05)
    style.phase_ticks(bottom, *bottom.get_ylim())
    style.log_frequency(bottom)
    top.set_ylabel("magnitude, dB")
    bottom.set_ylabel("phase, deg")
    top.set_title(data["title"])
    top.legend(loc="lower left")


def _step(data: dict[str, Any], fig: Figure) -> None:
    """Draw the step responses."""
    ax = fig.add_subplot()
    longest = max(series["time_s"][-1] for series in data["series"])
    scale, unit = time_unit(longest)
    for k, series in enumerate(data["series"]):
        ax.plot([t * scale for t in series["time_s"]], series["response"], label=series["label"], **_look(k))
    ax.set_xlabel(f"time, {unit}")
    ax.set_ylabel("response to a unit step")
    ax.set_title(data["title"])
    ax.legend(loc="lower right")
