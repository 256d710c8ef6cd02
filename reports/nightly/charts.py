"""Small line charts of a figure over the nights, as SVG that follows the page's colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from reports.nightly.text import one_line
from reports.nightly.trend import ChangePoint
from reports.numbers import significant

WIDTH, HEIGHT = 360, 132
_LEFT, _RIGHT, _TOP, _BOTTOM = 8, 54, 12, 20
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


def line_chart(chart: Chart) -> str:
    """Draw a chart: a line with gaps for missing nights, verticals at change points, the limit dashed."""
    finite = np.isfinite(chart.values)
    if not finite.any():
        return ""
    x, scale = _x(chart.times), _Scale.over(chart.values[finite], chart.limit)
    parts = [_frame(chart, scale)]
    parts.extend(_mark(float(x[point.index])) for point in chart.points)
    parts.extend(_stretch(x[run], scale(chart.values[run])) for run in _stretches(finite))
    last = int(np.flatnonzero(finite)[-1])
    parts.append(_last(float(x[last]), float(scale(chart.values[last])), float(chart.values[last])))
    label = escape(describe(chart))
    head = f'<svg class="chart" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{label}">'
    return head + "".join(parts) + "</svg>"


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


@dataclass(frozen=True)
class _Scale:
    low: float
    high: float

    @classmethod
    def over(cls, values: np.ndarray, limit: float | None) -> _Scale:
        low, high = float(values.min()), float(values.max())
        if limit is not None:
            low, high = min(low, limit), max(high, limit)
        pad = 0.12 * (high - low) or 0.05 * abs(high) or 1.0
        return cls(low - pad, high + pad)

    def __call__(self, value: np.ndarray | float) -> np.ndarray:
        span = HEIGHT - _TOP - _BOTTOM
        return np.asarray(_TOP + span * (self.high - np.asarray(value)) / (self.high - self.low))


def _x(times: np.ndarray) -> np.ndarray:
    span = float(times[-1] - times[0]) or 1.0
    width = WIDTH - _LEFT - _RIGHT
    if len(times) == 1:
        return np.array([_LEFT + width])
    return _LEFT + width * (times - times[0]) / span


def _frame(chart: Chart, scale: _Scale) -> str:
    right, base = WIDTH - _RIGHT, HEIGHT - _BOTTOM
    parts = [f'<path class="axis" d="M{_LEFT} {base}H{right}"/>']
    if chart.limit is not None:
        y = float(scale(chart.limit))
        label = min(max(y + 3, _TOP), base)
        parts.append(f'<path class="limit" d="M{_LEFT} {y:.1f}H{right}"/>')
        parts.append(f'<text class="limit-label" x="{_LEFT + 2}" y="{label - 6:.1f}">limit</text>')
    parts.append(f'<text x="{_LEFT}" y="{HEIGHT - 5}">{escape(chart.first_label)}</text>')
    parts.append(f'<text x="{right}" y="{HEIGHT - 5}" text-anchor="end">{escape(chart.last_label)}</text>')
    return "".join(parts)


def _mark(x: float) -> str:
    base = HEIGHT - _BOTTOM
    return (
        f'<path class="change" d="M{x:.1f} {_TOP}V{base}"/>'
        f'<path class="change-sign" d="M{x - 4.5:.1f} {_TOP - 8}h9l-4.5 7z"/>'
    )


def _stretches(finite: np.ndarray) -> list[slice]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], finite, [False]]).astype(int)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _stretch(x: np.ndarray, y: np.ndarray) -> str:
    if len(x) == 1:
        return f'<circle class="dot" cx="{x[0]:.1f}" cy="{float(y[0]):.1f}" r="1.8"/>'
    keep = _thinned(y)
    across, up = np.round(x[keep], 1).tolist(), np.round(y[keep], 1).tolist()
    steps = "".join(
        f"H{a:g}" if b == c else f"H{a:g}V{b:g}" for a, b, c in zip(across[1:], up[1:], up, strict=False)
    )
    return f'<path class="line" d="M{across[0]:g} {up[0]:g}{steps}"/>'


def _thinned(y: np.ndarray) -> np.ndarray:
    """Indexes that keep the shape of steps: ends and changes, of long rows the extremes of each stretch."""
    n = len(y)
    index = np.flatnonzero(np.concatenate([[True], np.abs(np.diff(y)) > 0.05]))
    index = np.unique(np.append(index, n - 1))
    if len(index) <= _MAX_POINTS:
        return index
    parts = np.array_split(np.arange(n), _MAX_POINTS // 2)
    extremes = [i for p in parts for i in sorted({int(p[np.argmin(y[p])]), int(p[np.argmax(y[p])])})]
    return np.array(sorted({0, *extremes, n - 1}))


def _last(x: float, y: float, value: float) -> str:
    label = min(max(y + 4, 10), HEIGHT - _BOTTOM)
    return (
        f'<circle class="last" cx="{x:.1f}" cy="{y:.1f}" r="3"/>'
        f'<text class="value" x="{x + 7:.1f}" y="{label:.1f}">{escape(significant(value, 4))}</text>'
    )
