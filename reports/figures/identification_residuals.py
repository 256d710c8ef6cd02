"""Residuals of the surface against speed and load, in units of N m and of their standard deviation."""

from __future__ import annotations

from typing import Literal, TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel


class Data(TypedDict):
    """One entry a run."""

    speed_rad_s: list[float]
    load_Nm: list[float]
    residual_uNm: list[float]
    std_uNm: list[float]
    outlier: list[bool]
    run: list[str]


def draw(data: Data) -> Chart:
    """Draw both views side by side."""
    chart = Chart(width=style.WIDE, height=310.0)
    _view(chart.panel(), data, "speed_rad_s", "motor speed, rad/s")
    _view(chart.panel(), data, "load_Nm", "load torque, N m")
    return chart


def _view(panel: Panel, data: Data, key: Literal["speed_rad_s", "load_Nm"], label: str) -> None:
    panel.rule_y(0.0)
    for x, y, std in zip(data[key], data["residual_uNm"], data["std_uNm"], strict=True):
        ends = [y - 2.0 * std, y + 2.0 * std]
        panel.curve([x, x], ends, colour=style.MUTED, width=0.9, read=False)
    panel.points(data[key], data["residual_uNm"], "runs, with 2 standard deviations", size=5.0)
    for k, bad in enumerate(data["outlier"]):
        if bad:
            at = (data[key][k], data["residual_uNm"][k])
            panel.points([at[0]], [at[1]], size=13.0, hollow=True, colour=style.RED, read=False)
            panel.note(data["run"][k], at)
    panel.x.label, panel.y.label = label, "residual, µN m"
