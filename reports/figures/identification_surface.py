"""Friction torque against speed: the runs and the fitted surface, one line for each load.

Data: ``levels`` of ``label``, ``speed_rad_s``, ``torque_mNm``, ``line_speed_rad_s``, ``line_torque_mNm``;
``outliers`` of ``run``, ``speed_rad_s``, ``torque_mNm``.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from reports.figures import style

SIZE = (8.4, 4.2)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw points and lines."""
    ax = fig.add_subplot()
    for k, level in enumerate(data["levels"]):
        colour = style.SERIES[k % 7]
        ax.plot(
            level["line_speed_rad_s"], level["line_torque_mNm"], color=colour, linestyle=style.DASHES[k % 7]
        )
        look: dict[str, Any] = {
            "color": colour,
            "marker": "osD^vPX"[k % 7],
            "markersize": 4.5,
            "linestyle": "none",
        }
        ax.plot(level["speed_rad_s"], level["torque_mNm"], label=level["label"], **look)
    for point in data["outliers"]:
        at = (point["speed_rad_s"], point["torque_mNm"])
        ax.plot(*at, marker="o", markersize=11, markerfacecolor="none", color=style.RED, linestyle="none")
        ax.annotate(point["run"], at, xytext=(8, 6), textcoords="offset points", bbox=style.label_box())
    ax.set_xlabel("motor speed, rad/s")
    ax.set_ylabel("friction torque at the motor, mN m")
    ax.set_ylim(bottom=0.0)
    ax.legend(loc="upper left", ncols=3)
