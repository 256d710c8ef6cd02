"""Small charts of a figure over the nights, with the live figures of every other page."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reports.charts import style
from reports.charts.chart import Chart
from reports.charts.svg import page_svg
from reports.nightly.text import one_line, to_seconds
from reports.nightly.trend import ChangePoint
from reports.numbers import significant

WIDTH, HEIGHT = 360.0, 150.0
DAY = 86400.0
_MAX_POINTS = 400


def line_chart(
    title: str, unit: str, nights: Sequence[str], values: np.ndarray, points: Sequence[ChangePoint],
    limit: float | None = None, prefix: str = "t",
) -> str:  # fmt: skip
    """Draw a figure over the nights: steps with gaps where there is none, lines at changes, the limit dashed.

    Parameters
    ----------
    nights : sequence of str
        When each began.
    values : ndarray, shape (nights,)
        NaN where a night has no such figure.
    """
    finite = np.isfinite(values)
    if not finite.any():
        return ""
    chart = Chart(width=WIDTH, height=HEIGHT)
    panel, days = chart.panel(), np.array([to_seconds(night) for night in nights]) / DAY
    first, last, span = float(days[0]), float(days[-1]), float(days[-1] - days[0])
    panel.x.days, panel.x.grid, panel.x.name = True, False, "night"
    panel.x.limits(first - 0.03 * max(span, 1.0), last + 0.03 * max(span, 1.0))
    ends = [(first + 0.1 * span, nights[0][:10]), (last - 0.1 * span, nights[-1][:10])]
    panel.x.ticks = ends if len(nights) > 1 else ends[1:]
    panel.y.name = f"value, {one_line(unit, 20)}" if unit else "value"
    if limit is not None:
        panel.rule_y(limit, "limit", seen=True, colour=style.RED, dash=1)
    for point in points:
        panel.rule_x(float(days[point.index]), "▼", colour=style.ORANGE, dash=2)
    x, y = _steps(days, values, finite)
    panel.curve(x, y, colour=style.BLUE, width=1.8)
    padded = np.concatenate([[False], finite, [False]])
    alone = np.flatnonzero(finite & ~padded[:-2] & ~padded[2:])  # a line does not show them
    shown = [*alone.tolist(), int(np.flatnonzero(finite)[-1])]
    panel.points(days[shown], values[shown], colour=style.BLUE, size=4.0, read=False)
    return page_svg(chart, prefix, _words(title, unit, values[finite], points, limit))


def _words(
    title: str, unit: str, values: np.ndarray, points: Sequence[ChangePoint], limit: float | None
) -> str:
    """Say a chart in words, for those who do not see it."""
    unit = f" {unit}" if unit else ""
    text = f"{one_line(title, 120)}: {significant(float(values[-1]), 4)}{unit} in the last night"
    if len(values) > 1:
        low, high = significant(float(values.min()), 4), significant(float(values.max()), 4)
        text += f", between {low} and {high} over {len(values)} nights, {len(points)} change(s) of level"
    return text if limit is None else f"{text}; limit {significant(limit, 4)}{unit}"


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
