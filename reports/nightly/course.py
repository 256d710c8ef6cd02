"""One design over all its nights: its charts, what never moved, and what happened in which night."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from markupsafe import Markup

from actuator_lti.files.tree import Tree
from reports.charts import style
from reports.charts.chart import Chart
from reports.charts.svg import page_svg
from reports.nightly.changes import Columns
from reports.nightly.figures import Figure
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
    columns = Columns(figures, night.study.tolerances)
    values = history.matrix(past, columns.names)
    moved = columns.moved(values[good[:-1]], values[good[1:]]).sum(axis=1).tolist()
    course = Course(moved={past[i].run: count for i, count in zip(good[1:], moved, strict=True)})
    size = np.max(np.abs(np.nan_to_num(values)), axis=0)
    allowed = columns.allowed(size, size).tolist()
    started = {run.id: run.started for run in night.runs}
    nights = [(result.run, started[result.run]) for result in past]
    verdicts = {f"{v['id']}: value": v for v in design.verdicts}
    for k in sorted(range(len(figures)), key=lambda k: figures[k].kind != "requirement"):
        figure = figures[k]
        shown = figure.kind in ("requirement", "check") or (figure.better and figure.kind == "figure")
        if shown and np.isfinite(values[:, k]).any():
            _add(course, figure, verdicts.get(figure.name, {}), nights, values[:, k], allowed[k])
    return course


def _add(
    course: Course, figure: Figure, verdict: Tree, nights: Sequence[tuple[int, str]], values: np.ndarray,
    tolerance: float,
) -> None:  # fmt: skip
    """Chart a figure, or count it among the steady ones."""
    skipped = max(len(values) - LOOK_BACK, 0)
    points = [replace(p, index=skipped + p.index) for p in change_points(values[skipped:], tolerance)]
    to_and_fro = flaps(values, tolerance)
    moved = bool(points) or to_and_fro
    if figure.kind != "requirement" and (not moved or len(course.charts) >= MAX_CHARTS):
        course.steady.append(figure)
        return
    for point in points:
        course.marks.setdefault(nights[point.index][0], []).append((figure, point))
    title, started = verdict.get("label", figure.name), [start for _, start in nights]
    drawn = line_chart(
        title, figure.unit, started, values, points, verdict.get("bound"), f"t{len(course.charts)}"
    )
    course.charts.append(
        {
            "title": title,
            "id": verdict.get("id", ""),
            "unit": figure.unit,
            "svg": Markup(drawn),
            "points": [(started[p.index][:10], p) for p in points],
            "flaps": to_and_fro,
        }
    )


def line_chart(
    title: str, unit: str, nights: Sequence[str], values: np.ndarray, points: Sequence[ChangePoint],
    limit: float | None = None, prefix: str = "t",
) -> str:  # fmt: skip
    """Draw a figure over the nights (texts of when each began; NaN: a night without the figure).

    Steps with gaps where there is none, lines at changes of level, the limit dashed.
    """
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
    corners = _corners(values)
    up = np.repeat(values[corners], 2)[:-1]
    up[1::2][np.isnan(values[corners[1:]])] = np.nan  # no step into a gap
    panel.curve(np.repeat(days[corners], 2)[1:], up, colour=style.BLUE, width=1.8)
    finite = np.isfinite(values)
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


def _corners(values: np.ndarray) -> np.ndarray:
    """Indexes that keep the shape of steps: changes, ends and gaps, of long rows extremes of each stretch."""
    gap = np.isnan(values)
    ends = gap | np.append(gap[1:], True)
    ends[0] = True
    corners = np.flatnonzero(ends | np.append(True, values[1:] != values[:-1]))
    if len(corners) <= _MAX_POINTS:
        return corners
    parts = [part[~gap[part]] for part in np.array_split(np.arange(len(values)), _MAX_POINTS // 2)]
    extremes = [part[f(values[part])] for part in parts if len(part) for f in (np.argmin, np.argmax)]
    return np.union1d(np.flatnonzero(ends), extremes).astype(int)
