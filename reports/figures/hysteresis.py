"""Lost motion by dry friction, and how long a step below the threshold waits.

Data: ``loops`` of ``label``, ``command``, ``error``; ``waits`` of ``label``, ``amplitude``,
``predicted_ms``, ``simulated_ms`` (may be empty); ``unit``, ``error_unit``, ``wait_unit``.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from reports.figures import style

SIZE = (10.6, 3.8)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the loops, and the waiting times where there are any."""
    axes = fig.subplots(1, 2 if data["waits"] else 1, squeeze=False)[0]
    for k, loop in enumerate(data["loops"]):
        look = {"color": style.SERIES[k % 7], "linestyle": style.DASHES[k % 7], "label": loop["label"]}
        axes[0].plot([*loop["command"], loop["command"][0]], [*loop["error"], loop["error"][0]], **look)
    axes[0].axhline(0.0, color=style.MUTED, linewidth=0.8)
    axes[0].set_title("Position error over a slow triangle of the command")
    axes[0].set_xlabel(f"command, {data['unit']}")
    axes[0].set_ylabel(f"output less command, {data['error_unit']}")
    low, high = axes[0].get_ylim()
    axes[0].set_ylim(low, high + 0.22 * (high - low))
    axes[0].legend(loc="upper right", ncols=2)
    if data["waits"]:
        _waits(axes[1], data)


def _waits(ax: Axes, data: dict[str, Any]) -> None:
    """Draw the time until the output moves against the size of the step."""
    for k, wait in enumerate(data["waits"]):
        colour = style.SERIES[k % 7]
        ax.plot(
            wait["amplitude"], style.gaps(wait["predicted_ms"]), color=colour, linestyle=style.DASHES[k % 7]
        )
        look: dict[str, Any] = {
            "color": colour,
            "marker": "os^D"[k % 4],
            "linestyle": "none",
            "markersize": 5.0,
        }
        ax.plot(wait["amplitude"], style.gaps(wait["simulated_ms"]), label=wait["label"], **look)
    ax.set_xscale("log")
    ax.set_yscale("log")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(style.plain_decade))
        axis.set_minor_formatter(FuncFormatter(lambda _value, _position: ""))
    ax.set_title("Wait before a small step moves the output")
    ax.set_xlabel(f"step, {data['wait_unit']}")
    ax.set_ylabel("time to first motion, ms")
    ax.legend(loc="lower left", title="lines: foreseen, points: simulated")
