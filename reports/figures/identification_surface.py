"""Friction torque against speed: the runs and the fitted surface, one line for each load.

Data: ``levels`` of ``label``, ``speed_rad_s``, ``torque_mNm``, ``line_speed_rad_s``, ``line_torque_mNm``;
``outliers`` of ``run``, ``speed_rad_s``, ``torque_mNm``.
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart


def draw(data: dict[str, Any]) -> Chart:
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
