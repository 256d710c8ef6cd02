"""One design over all its nights: its charts, what never moved, and what happened in which night."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from markupsafe import Markup

from actuator_lti.files.tree import Tree
from reports.charts import style
from reports.charts.chart import Chart
from reports.charts.svg import page_svg
from reports.nightly.changes import Columns
from reports.nightly.figures import Figure, Verdict
from reports.nightly.history import History
from reports.nightly.records import Result
from reports.nightly.text import one_line, to_seconds
from reports.nightly.trend import LOOK_BACK, ChangePoint, change_points, flaps
from reports.nightly.view import DesignView, Overview
from reports.numbers import significant

MAX_CHARTS = 60
WIDTH, HEIGHT = 360.0, 150.0
DAY = 86400.0
_MAX_POINTS = 400


@dataclass
class Course:
    """Charts for the page, figures without a change, change points and number of moves by night."""

    charts: list[Tree] = field(default_factory=list)
    steady: list[Figure] = field(default_factory=list)
    marks: dict[int, list[tuple[Figure, ChangePoint]]] = field(default_factory=dict)
    moved: dict[int, int] = field(default_factory=dict)


def course_of(night: Overview, design: DesignView, history: History, past: Sequence[Result]) -> Course:
    """Put together the course of a design.

    Requirements are always charted; margins and other figures with a better side only where they moved.
    """
    good = [i for i, result in enumerate(past) if result.home is not None]
    if not good:
        return Course()
    figures = list(history.figures(past[good[-1]]).values())
    columns = Columns(figures, night.tolerances)
    values = history.matrix(past, columns.names)
    moved = columns.moved(values[good[:-1]], values[good[1:]]).sum(axis=1).tolist()
    course = Course(moved={past[i].run: count for i, count in zip(good[1:], moved, strict=True)})
    size = np.max(np.abs(np.nan_to_num(values)), axis=0)
    allowed = columns.allowed(size, size).tolist()
    of = _Design(design, past, {run.id: run.started for run in night.runs})
    for k in sorted(range(len(figures)), key=lambda k: figures[k].kind != "requirement"):
        shown = figures[k].kind in ("requirement", "check") or (
            figures[k].better and figures[k].kind == "figure"
        )
        if shown and np.isfinite(values[:, k]).any():
            of.add(course, figures[k], values[:, k], allowed[k])
    return course


class _Design:
    """A design whose figures are charted."""

    def __init__(self, design: DesignView, past: Sequence[Result], started: Mapping[int, str]) -> None:
        self.past, self.nights = past, [started[result.run] for result in past]
        self.verdicts: Mapping[str, Verdict] = {f"{v.id}: value": v for v in design.verdicts}

    def add(self, course: Course, figure: Figure, values: np.ndarray, tolerance: float) -> None:
        """Chart a figure, or count it among the steady ones."""
        points, to_and_fro = _recent(values, tolerance), flaps(values, tolerance)
        moved = bool(points) or to_and_fro
        if figure.kind != "requirement" and (not moved or len(course.charts) >= MAX_CHARTS):
            course.steady.append(figure)
            return
        for point in points:
            course.marks.setdefault(self.past[point.index].run, []).append((figure, point))
        verdict = self.verdicts.get(figure.name)
        title, limit = (verdict.label, verdict.bound) if verdict else (figure.name, None)
        drawn = line_chart(title, figure.unit, self.nights, values, points, limit, f"t{len(course.charts)}")
        course.charts.append(
            {
                "title": title,
                "id": verdict.id if verdict else "",
                "unit": figure.unit,
                "svg": Markup(drawn),
                "points": [(self.nights[p.index][:10], p) for p in points],
                "flaps": to_and_fro,
            }
        )


def _recent(values: np.ndarray, tolerance: float) -> tuple[ChangePoint, ...]:
    """Find the changes of level of the last nights."""
    start = max(len(values) - LOOK_BACK, 0)
    result = change_points(values[start:], tolerance)
    return tuple(replace(point, index=start + point.index) for point in result)


def line_chart(
    title: str, unit: str, nights: Sequence[str], values: np.ndarray, points: Sequence[ChangePoint],
    limit: float | None = None, prefix: str = "t",
) -> str:  # fmt: skip
    """Draw a figure over the nights (texts of when each began; NaN: a night without the figure).

    Steps with gaps where there is none, lines at changes of level, the limit dashed.
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
