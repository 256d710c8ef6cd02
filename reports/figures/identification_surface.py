"""Friction torque against speed: the runs and the fitted surface, one line for each load."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart, Values


class Level(TypedDict):
    """Runs of one load, and the fitted line."""

    label: str
    speed_rad_s: Values
    torque_mNm: Values
    line_speed_rad_s: Values
    line_torque_mNm: Values


class Outlier(TypedDict):
    """A run that was left out."""

    run: str
    speed_rad_s: float
    torque_mNm: float


class Data(TypedDict):
    """Friction torque against speed."""

    levels: list[Level]
    outliers: list[Outlier]


def draw(data: Data) -> Chart:
    """Draw points and lines."""
    chart = Chart(width=style.WIDE, height=380.0, legend=True)
    panel = chart.panel()
    for k, level in enumerate(data["levels"]):
        panel.curve(level["line_speed_rad_s"], level["line_torque_mNm"], level["label"], **style.series(k))
        look = {"colour": style.SERIES[k % 7], "marker": "osD^v+x"[k % 7], "size": 6.0}
        panel.points(level["speed_rad_s"], level["torque_mNm"], level["label"], **look)
    for point in data["outliers"]:
        at = (point["speed_rad_s"], point["torque_mNm"])
        panel.points([at[0]], [at[1]], size=14.0, hollow=True, colour=style.RED, read=False)
        panel.note(point["run"], at)
    panel.x.label, panel.y.label = "motor speed, rad/s", "friction torque at the motor, mN m"
    panel.y.limits(low=0.0)
    return chart
