"""Residuals of the surface against speed and load, in units of N m and of their standard deviation.

Data: ``speed_rad_s``, ``load_Nm``, ``residual_uNm``, ``std_uNm``, ``outlier`` (true or false), ``run``.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures import style

SIZE = (8.4, 3.4)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw both views side by side."""
    left, right = fig.subplots(1, 2, sharey=True)
    _view(left, data, "speed_rad_s", "motor speed, rad/s")
    _view(right, data, "load_Nm", "hinge moment, N m")
    left.set_ylabel("residual, µN m")


def _view(ax: Axes, data: dict[str, Any], key: str, label: str) -> None:
    ax.axhline(0.0, color=style.MUTED, linewidth=0.9)
    ends = [2.0 * std for std in data["std_uNm"]]
    ax.errorbar(
        data[key],
        data["residual_uNm"],
        yerr=ends,
        color=style.BLUE,
        ecolor=style.MUTED,
        elinewidth=0.7,
        marker="o",
        markersize=3.5,
        linestyle="none",
        label="runs, with 2 standard deviations",
    )
    for k, bad in enumerate(data["outlier"]):
        if bad:
            at = (data[key][k], data["residual_uNm"][k])
            ax.plot(*at, marker="o", markersize=10, markerfacecolor="none", color=style.RED, linestyle="none")
            ax.annotate(data["run"][k], at, xytext=(7, 5), textcoords="offset points", bbox=style.label_box())
    ax.set_xlabel(label)
