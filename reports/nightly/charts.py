"""Small charts of a figure over the nights, with the live figures of every other page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reports.charts import chart as figures
from reports.charts import style
from reports.charts.svg import page_svg
from reports.nightly.text import one_line
from reports.nightly.trend import ChangePoint
from reports.numbers import significant

WIDTH, HEIGHT = 360.0, 150.0
DAY = 86400.0
_MAX_POINTS = 400


@dataclass(frozen=True, kw_only=True)
class Chart:
    """What one chart shows; ``times`` in s, ``values`` with NaN where there is none."""

    title: str
    unit: str
    times: np.ndarray
    values: np.ndarray
    points: Sequence[ChangePoint]
    limit: float | None = None
    first_label: str = ""
    last_label: str = ""


def line_chart(chart: Chart, prefix: str = "t") -> str:
    """Draw a chart: steps with gaps for missing nights, lines at changes of level, the limit dashed."""
    finite = np.isfinite(chart.values)
    if not finite.any():
        return ""
    made = figures.Chart(width=WIDTH, height=HEIGHT)
    panel, days = made.panel(), chart.times / DAY
    room = 0.03 * max(float(days[-1] - days[0]), 1.0)
    panel.x.days, panel.x.grid = True, False
    panel.x.limits(float(days[0]) - room, float(days[-1]) + room)
    panel.x.ticks = _dates(chart, days)
    panel.x.name = "night"
    panel.y.name = f"value, {one_line(chart.unit, 20)}" if chart.unit else "value"
    if chart.limit is not None:
        panel.rule_y(chart.limit, "limit", colour=style.RED, dash=1)
        panel.y.see([chart.limit])
    for point in chart.points:
        panel.rule_x(float(days[point.index]), "▼", colour=style.ORANGE, dash=2)
    x, y = _steps(days, chart.values, finite)
    panel.curve(x, y, colour=style.BLUE, width=1.8)
    last = int(np.flatnonzero(finite)[-1])
    alone = [*_alone(finite), last]
    panel.points(days[alone], chart.values[alone], colour=style.BLUE, size=4.0, read=False)
    return page_svg(made, prefix, describe(chart))


def _dates(chart: Chart, days: np.ndarray) -> list[tuple[float, str]]:
    """Name the first night and the last."""
    room = 0.1 * float(days[-1] - days[0])
    ends = [(float(days[-1]) - room, chart.last_label)]
    return [(float(days[0]) + room, chart.first_label), *ends] if chart.first_label else ends


def _alone(finite: np.ndarray) -> list[int]:
    """Find nights between two without a result: a line does not show them."""
    padded = np.concatenate([[False], finite, [False]])
    return [int(k) for k in np.flatnonzero(finite & ~padded[:-2] & ~padded[2:])]


def _steps(days: np.ndarray, values: np.ndarray, finite: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Give corners of the steps from night to night, NaN in the gaps, long courses thinned."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], finite, [False]]).astype(int)))
    x: list[np.ndarray] = []
    y: list[np.ndarray] = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        kept = begin + _thinned(values[begin:end])
        across, up = np.repeat(days[kept], 2)[1:], np.repeat(values[kept], 2)[:-1]
        x += [across, np.array([np.nan])]
        y += [up, np.array([np.nan])]
    return np.concatenate(x), np.concatenate(y)


def describe(chart: Chart) -> str:
    """Say a chart in words, for those who do not see it."""
    values = chart.values[np.isfinite(chart.values)]
    unit = f" {chart.unit}" if chart.unit else ""
    text = f"{one_line(chart.title, 120)}: {significant(float(values[-1]), 4)}{unit} in the last night"
    if len(values) > 1:
        low, high = significant(float(values.min()), 4), significant(float(values.max()), 4)
        text += (
            f", between {low} and {high} over {len(values)} nights, {len(chart.points)} change(s) of level"
        )
    if chart.limit is not None:
        text += f"; limit {significant(chart.limit, 4)}{unit}"
    return text


def _thinned(y: np.ndarray) -> np.ndarray:
    """Indexes that keep the shape of steps: ends and changes, of long rows the extremes of each stretch."""
    n = len(y)
    index = np.flatnonzero(np.concatenate([[True], np.abs(np.diff(y)) > 0.0]))
    index = np.unique(np.append(index, n - 1))
    if len(index) <= _MAX_POINTS:
        return index
    parts = np.array_split(np.arange(n), _MAX_POINTS // 2)
    extremes = [i for p in parts for i in sorted({int(p[np.argmin(y[p])]), int(p[np.argmax(y[p])])})]
    return np.array(sorted({0, *extremes, n - 1}))
