"""A simulated motion: position, speed, current and voltage, limits drawn and shaded where active.

Data: ``time_s``; ``panels``, each with ``label``, ``series`` of ``label``, ``values``; ``limit`` (or null),
``limit_label``; ``active`` [[from_s, to_s], ...] where the limiter acts.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures import style
from reports.numbers import time_unit

SIZE = (7.2, 7.2)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the panels one below the other on one time axis."""
    scale, unit = time_unit(data["time_s"][-1])
    axes = fig.subplots(len(data["panels"]), 1, sharex=True, squeeze=False)[:, 0]
    time = [t * scale for t in data["time_s"]]
    for ax, panel in zip(axes, data["panels"], strict=True):
        _panel(ax, panel, time, scale)
    axes[-1].set_xlabel(f"time, {unit}")
    axes[-1].set_xlim(time[0], time[-1])


def _panel(ax: Axes, panel: dict[str, Any], time: list[float], scale: float) -> None:
    """Draw the signals of one panel, its limit and the spans in which the limit acts."""
    for k, (start, stop) in enumerate(panel["active"]):
        words = f"{panel['limit_label']} limit acts" if k == 0 else None
        ax.axvspan(start * scale, stop * scale, color=style.RED, alpha=0.13, linewidth=0, label=words)
    # the command lies under the response: drawn last in the list, first on the paper
    for k, series in reversed(list(enumerate(panel["series"]))):
        look = {"color": style.SERIES[k], "linestyle": style.DASHES[k], "label": series["label"]}
        ax.plot(time, style.gaps(series["values"]), linewidth=1.8 if k == 0 else 1.3, **look)
    _limit(ax, panel)
    ax.set_ylabel(panel["label"])
    handles, labels = ax.get_legend_handles_labels()
    if len(labels) > 1:
        place: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 0.97), "borderaxespad": 0.0}
        ax.legend(handles[::-1], labels[::-1], ncols=len(labels), **place)


def _limit(ax: Axes, panel: dict[str, Any]) -> None:
    """Draw both signs of the limit where it lies within reach of the signals."""
    if panel["limit"] is None:
        return
    values = [abs(v) for series in panel["series"] for v in series["values"] if v is not None]
    peak = max(values, default=0.0)
    if panel["limit"] > 4.0 * peak:
        words = f"limit ±{panel['limit']:.4g}"
        ax.text(0.01, 0.95, words, transform=ax.transAxes, va="top", fontsize=8.5, bbox=style.label_box())
        return
    for sign in (1.0, -1.0):
        ax.axhline(sign * panel["limit"], color=style.RED, linewidth=1.1, linestyle=(0, (7, 3)))
