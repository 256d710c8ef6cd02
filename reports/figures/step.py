"""Step response with rise time, overshoot and settling time.

Data: ``time_s``, ``series`` of ``label``, ``response``; ``final``; ``rise`` [t10, t90] or null;
``settling_s``, ``overshoot_percent``, ``peak_time_s`` or null; ``held`` (drawn as stairs).
"""

from __future__ import annotations

from typing import Any

from reports.figures import style
from reports.figures.style import Chart, Panel
from reports.numbers import seconds


def draw(data: dict[str, Any]) -> Chart:
    """Draw the responses and the figures read from the first."""
    small = bool(data.get("small"))
    chart = Chart(
        width=style.SMALL if small else style.HALF,
        height=280.0 if small else 225.0,
        loop=data.get("loop", ""),
    )
    panel = chart.panel()
    scale = style.time_axis(panel, data["time_s"][-1])
    for k, series in enumerate(data["series"]):
        time = [t * scale for t in series.get("time_s") or data["time_s"]]
        held = bool(data.get("held")) and len(time) < 80
        panel.curve(time, series["response"], series["label"], stairs=held, **style.series(k))
    panel.y.label = "response to a unit step"
    panel.x.limits(0.0, data["time_s"][-1] * scale)
    values = style.known(y for s in data["series"] for y in s["response"])
    panel.y.limits(low=min(0.0, 1.05 * min(values, default=0.0)))
    if data.get("final") is not None:
        _band(data, panel, scale)
    return chart


def _band(data: dict[str, Any], panel: Panel, scale: float) -> None:
    """Draw the 2 % band, the 10-90 % rise and the settling time."""
    final, last = data["final"], data["time_s"][-1]
    panel.band_y(0.98 * final, 1.02 * final, colour=style.GREEN)
    panel.rule_y(final)
    words = []
    if data.get("rise"):
        for t, level in zip(data["rise"], (0.1 * final, 0.9 * final), strict=True):
            if t <= last:
                panel.points([t * scale], [level], colour=style.GREEN, size=6.0, read=False)
        words.append(f"rise 10–90 %: {seconds(data['rise'][1] - data['rise'][0])}")
    if data.get("overshoot_percent") is not None:
        words.append(f"overshoot: {data['overshoot_percent']:.1f} %")
    if data.get("settling_s") is not None:
        if data["settling_s"] <= last:
            panel.rule_x(data["settling_s"] * scale, colour=style.PURPLE, width=1.3, dash=1)
        words.append(f"settled to 2 %: {seconds(data['settling_s'])}")
    if words:
        panel.note("\n".join(words), corner="bottom right")
