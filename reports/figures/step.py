"""Step response with rise time, overshoot and settling time.

Data: ``time_s``, ``series`` of ``label``, ``response``; ``final``; ``rise`` [t10, t90] or null;
``settling_s``, ``overshoot_percent``, ``peak_time_s`` or null; ``held`` (drawn as stairs).
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures import style
from reports.numbers import seconds, time_unit

SIZE = (5.2, 2.75)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the responses and the figures read from the first."""
    ax = fig.add_subplot()
    scale, unit = time_unit(data["time_s"][-1])
    for k, series in enumerate(data["series"]):
        time = [t * scale for t in series.get("time_s") or data["time_s"]]
        look = {"color": style.SERIES[k % 7], "linestyle": style.DASHES[k % 7], "label": series["label"]}
        how = "steps-post" if data.get("held") and len(time) < 80 else "default"
        ax.plot(time, style.gaps(series["response"]), drawstyle=how, **look)
    ax.set_xlabel(f"time, {unit}")
    ax.set_ylabel("response to a unit step")
    ax.set_xlim(0, data["time_s"][-1] * scale)
    ax.set_ylim(bottom=min(0.0, *(y for s in data["series"] for y in s["response"] if y is not None)))
    if data.get("final") is not None:
        _band(data, ax, scale)
    if len(data["series"]) > 1:
        ax.legend(loc="lower right")


def _band(data: dict[str, Any], ax: Axes, scale: float) -> None:
    """Draw the 2 % band, the 10-90 % rise and the settling time."""
    final = data["final"]
    ax.axhspan(0.98 * final, 1.02 * final, color=style.GREEN, alpha=0.12, linewidth=0)
    ax.axhline(final, color=style.MUTED, linewidth=0.9)
    words = []
    if data.get("rise"):
        t10, t90 = (t * scale for t in data["rise"])
        for t, level in ((t10, 0.1 * final), (t90, 0.9 * final)):
            if t <= ax.get_xlim()[1]:
                ax.plot([t], [level], marker="o", markersize=4.5, color=style.GREEN, linestyle="none")
        words.append(f"rise 10–90 %: {seconds(data['rise'][1] - data['rise'][0])}")
    if data.get("overshoot_percent") is not None:
        words.append(f"overshoot: {data['overshoot_percent']:.1f} %")
    if data.get("settling_s") is not None and data["settling_s"] <= data["time_s"][-1]:
        ax.axvline(data["settling_s"] * scale, color=style.PURPLE, linewidth=1.2, linestyle=(0, (5, 2)))
    if data.get("settling_s") is not None:
        words.append(f"settled to 2 %: {seconds(data['settling_s'])}")
    if words:
        place: dict[str, Any] = {"transform": ax.transAxes, "ha": "right", "va": "center", "linespacing": 1.5}
        ax.text(
            0.985, 0.42 if len(data["series"]) > 1 else 0.2, "\n".join(words), bbox=style.label_box(), **place
        )
