"""The sawtooth: position, speed and current of a sine that is faster than the speed limit, a column a load.

Data: ``columns`` of ``title``, ``time_s``, ``reference``, ``output``, ``rate``, ``command_rate``,
``current`` (or null), ``note``; ``rate_limit``; ``unit``, ``rate_unit``.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures import style

SIZE = (10.6, 6.0)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the columns on common scales."""
    columns = data["columns"]
    rows = 3 if columns[0]["current"] is not None else 2
    axes = fig.subplots(rows, len(columns), sharex=True, sharey="row", squeeze=False)
    for k, column in enumerate(columns):
        _column(axes[:, k], column, data, first=k == 0)
    reach = max(abs(v) for column in columns for v in column["reference"])
    axes[0, 0].set_ylim(-1.6 * reach, 1.95 * reach)
    fig.suptitle(
        "Sawtooth: a sine faster than the rate limit", x=0.01, ha="left", fontsize=9.5, weight="bold"
    )
    words: dict[str, Any] = {"loc": "lower right", "ncols": 2, "columnspacing": 1.2}
    axes[0, 0].legend(**words)
    axes[1, 0].legend(**words)
    top = data["rate_limit"] * 1.75
    axes[1, 0].set_ylim(-top, 1.25 * data["rate_limit"])


def _column(axes: Any, column: dict[str, Any], data: dict[str, Any], *, first: bool) -> None:
    """Draw one load."""
    time = column["time_s"]
    position: Axes = axes[0]
    position.plot(time, column["reference"], color=style.MUTED, linestyle=style.DASHES[1], label="command")
    position.plot(time, column["output"], color=style.BLUE, label="output")
    position.set_title(column["title"])
    place: dict[str, Any] = {"transform": position.transAxes, "va": "top", "ha": "left", "fontsize": 8.5}
    position.text(0.015, 0.985, column["note"], linespacing=1.35, bbox=style.label_box(), **place)
    rate: Axes = axes[1]
    rate.plot(
        time, column["command_rate"], color=style.MUTED, linestyle=style.DASHES[1], label="speed command"
    )
    rate.plot(time, column["rate"], color=style.GREEN, label="output rate")
    for sign in (1.0, -1.0):
        rate.axhline(sign * data["rate_limit"], color=style.RED, linewidth=1.0, linestyle=(0, (5, 2)))
    if first:
        position.set_ylabel(f"position, {data['unit']}")
        rate.set_ylabel(f"rate, {data['rate_unit']}")
        low = -1.06 * data["rate_limit"]
        rate.text(time[0], low, "rate limit", color=style.RED, fontsize=8.5, va="top")
    if len(axes) > 2:
        axes[2].plot(time, column["current"], color=style.ORANGE)
        if first:
            axes[2].set_ylabel("motor current, A")
    axes[-1].set_xlabel("time, s")
    axes[-1].set_xlim(time[0], time[-1])
