"""Command amplitude at which each limiter is reached, over frequency: the border of linear validity."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from reports.figures import style
from reports.figures.style import Chart, Values


class Series(TypedDict):
    """One limiter."""

    label: str
    amplitude: Values


class Data(TypedDict):
    """Command amplitude at which each limiter is reached."""

    frequency_hz: list[float]
    series: list[Series]
    unit: str
    full_deflection: NotRequired[float | None]


def draw(data: Data) -> Chart:
    """Draw every limiter's line; below the lowest the linear model holds."""
    chart = Chart(width=style.WIDE, height=370.0, legend=True, legend_title="limit reached at this amplitude")
    panel = chart.panel()
    f = data["frequency_hz"]
    columns = zip(*(series["amplitude"] for series in data["series"]), strict=True)
    lowest = [min(style.known(column), default=None) for column in columns]
    known = style.known(lowest)
    full = data.get("full_deflection")
    top = max([full or 0.0, *known[:1]]) * 4 if known else 1.0
    bottom = max(min(known, default=0.1) * 0.6, top / 1e6)
    panel.y.log, panel.y.label = True, f"command amplitude, {data['unit']}"
    panel.y.limits(bottom, top)
    style.frequency(panel, f)
    there = [(x, y) for x, y in zip(f, lowest, strict=True) if y is not None]
    if there:
        x, y = [p[0] for p in there], [p[1] for p in there]
        floor = bottom * 1e-3
        panel.shape([([*x, x[-1], x[0]], [*y, floor, floor])], colour=style.GREEN, opacity=0.1)
    for k, series in enumerate(data["series"]):
        panel.curve(f, series["amplitude"], series["label"], **style.series(k))
    panel.note("linear below the lowest line", corner="bottom left", colour=style.MUTED)
    if full:
        panel.rule_y(full, f"full deflection {full:g} {data['unit']}", colour=style.INK, dash=2)
    return chart
