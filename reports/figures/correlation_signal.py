"""A signal measured and modelled, and the difference below.

Data: ``time_s``, ``measured``, ``modelled``, ``difference``; ``label`` (with unit), ``difference_label``.
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart


def draw(data: dict[str, Any]) -> Chart:
    """Draw both, and the difference."""
    chart = Chart(width=style.WIDE, height=380.0)
    upper, lower = chart.column(2.2, 1.0)
    upper.curve(data["time_s"], data["measured"], "measured", colour=style.BLUE)
    upper.curve(data["time_s"], data["modelled"], "model", colour=style.ORANGE, width=1.4, dash=1)
    upper.y.label = data["label"]
    lower.rule_y(0.0)
    lower.curve(data["time_s"], data["difference"], colour=style.RED, width=1.1)
    lower.y.label, lower.x.label = data["difference_label"], "time, s"
    lower.x.limits(data["time_s"][0], data["time_s"][-1])
    return chart
