"""The torque-speed plane of the motor: bounds, what steady motion needs, and paths of manoeuvres.

Data: ``title``; ``bounds``, ``demands``, ``paths`` of ``label``, ``speed``, ``torque``; ``speed_label``,
``torque_label``; ``top`` (torque up to which the frame reaches), ``fast`` (speed likewise).
Motion backwards is turned by half a turn, so that torque below zero brakes.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures import style

SIZE = (10.6, 4.8)
BOUND_COLOURS = {
    "voltage limit": style.RED,
    "drive signal at its limit": style.RED,
    "peak current": style.ORANGE,
    "continuous current": style.BROWN,
    "speed limit": style.BLUE,
}


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw bounds with their names on them, then demands and paths."""
    ax = fig.add_subplot()
    ax.set_xlim(-0.02 * data["fast"], data["fast"])
    ax.set_ylim(-1.12 * data["top"], 1.25 * data["top"])
    ax.axhline(0.0, color=style.MUTED, linewidth=0.8)
    for k, path in enumerate(data["paths"]):
        look: dict[str, Any] = {"color": style.SERIES[(k + 2) % 7], "linestyle": style.DASHES[k % 7]}
        look |= {"linewidth": 1.3}
        ax.plot(path["speed"], path["torque"], label=path["label"], **look)
    for bound in data["bounds"]:
        _bound(ax, bound, data)
    for k, demand in enumerate(data["demands"]):
        ax.plot(
            demand["speed"], demand["torque"], color=style.INK, linewidth=1.4, linestyle=(0, (2, 1.5)),
            marker="os^D"[k % 4], markersize=4.0, markevery=8, label=demand["label"],
        )  # fmt: skip
    ax.set_title(data["title"])
    ax.set_xlabel(data["speed_label"])
    ax.set_ylabel(data["torque_label"])
    fig.legend(loc="outside right upper")


def _bound(ax: Axes, bound: dict[str, Any], data: dict[str, Any]) -> None:
    """Draw one bound in both halves, named once."""
    colour = BOUND_COLOURS.get(bound["label"], style.INK)
    upright = bound["speed"][0] == bound["speed"][-1]
    low = [-t for t in bound["torque"]]
    look: dict[str, Any] = {"color": colour, "linewidth": 1.2, "linestyle": (0, (7, 2))}
    ax.plot(bound["speed"], bound["torque"], **look)
    if upright or bound["torque"][0] == bound["torque"][-1]:
        ax.plot(bound["speed"], low, **look)
    words: dict[str, Any] = {"color": colour, "fontsize": 8.5, "bbox": style.label_box(), "clip_on": True}
    if upright:
        ax.text(
            bound["speed"][0],
            -0.75 * data["top"],
            bound["label"],
            ha="center",
            va="center",
            rotation=90,
            **words,
        )
        return
    if bound["torque"][0] == bound["torque"][-1]:
        ax.text(0.02 * data["fast"], bound["torque"][0], bound["label"], ha="left", va="bottom", **words)
        return
    inside = [
        (s, t)
        for s, t in zip(bound["speed"], bound["torque"], strict=True)
        if s < 0.97 * data["fast"] and t < 1.2 * data["top"]
    ]
    if inside:
        ax.text(*inside[len(inside) // 2], bound["label"], ha="right", va="bottom", **words)
