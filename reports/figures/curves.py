"""Curves over a common kind of x: the plain figure for whatever has no form of its own.

Data: ``series`` of ``label``, ``x``, ``y`` (``style``: "line" or "points"); ``x_label``, ``y_label``;
optional ``x_log``, ``y_log``, ``levels`` (``y``, ``label``).
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from reports.figures import style

SIZE = (8.4, 3.4)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the curves."""
    ax = fig.add_subplot()
    for k, series in enumerate(data["series"]):
        points = series.get("style") == "points"
        look: dict[str, Any] = {"color": style.SERIES[k % 7], "label": series["label"]}
        look |= {"linestyle": "none", "marker": "osD^v"[k % 5], "markersize": 4} if points else {}
        look |= {} if points else {"linestyle": style.DASHES[k % 7]}
        ax.plot(style.gaps(series["x"]), style.gaps(series["y"]), **look)
    for level in data.get("levels", ()):
        ax.axhline(level["y"], color=style.RED, linewidth=1.1, linestyle=(0, (5, 2)), label=level["label"])
    ax.set_xlabel(data["x_label"])
    ax.set_ylabel(data["y_label"])
    if data.get("x_log"):
        style.log_frequency(ax, data["x_label"])
    if data.get("y_log"):
        ax.set_yscale("log")
        ax.yaxis.set_major_formatter(FuncFormatter(style.plain_decade))
    if len(data["series"]) > 1 or data.get("levels"):
        ax.legend()
