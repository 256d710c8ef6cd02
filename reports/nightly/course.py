"""One design over all its nights: its charts, what never moved, and what happened in which night."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from markupsafe import Markup

from actuator_lti.files.tree import Tree
from reports.nightly.charts import line_chart
from reports.nightly.figures import Figure, Verdict, first_number
from reports.nightly.history import History
from reports.nightly.records import Result
from reports.nightly.tolerance import Tolerances
from reports.nightly.trend import LOOK_BACK, ChangePoint, change_points, flaps
from reports.nightly.view import DesignView, Overview

MAX_CHARTS = 60


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
    good = [r for r in past if r.home is not None]
    if not good:
        return Course()
    figures = list(history.figures(good[-1]).values())
    values = history.matrix(past, [figure.name for figure in figures])
    writer = _Writer(night, design, past)
    writer.course.moved = _moved(past, values, figures, night.tolerances)
    for column in sorted(range(len(figures)), key=lambda j: figures[j].kind != "requirement"):
        figure = figures[column]
        if figure.kind in ("requirement", "check") or (figure.better and figure.kind == "figure"):
            writer.add(figure, values[:, column])
    return writer.course


class _Writer:
    def __init__(self, night: Overview, design: DesignView, past: Sequence[Result]) -> None:
        started = {r.id: r.started for r in night.runs}
        self.course = Course()
        self.past = past
        self.tolerances: Tolerances = night.tolerances
        self.nights = [started[r.run] for r in past]
        self.verdicts: Mapping[str, Verdict] = {f"{v.id}: value": v for v in design.verdicts}

    def add(self, figure: Figure, values: np.ndarray) -> None:
        """Chart a figure, or count it among the steady ones."""
        finite = values[np.isfinite(values)]
        if not len(finite):
            return
        tolerance = self.tolerances.of(figure, float(np.max(np.abs(finite))))
        points, to_and_fro = _recent(values, tolerance), flaps(values, tolerance)
        charts, moved = self.course.charts, bool(points) or to_and_fro
        if figure.kind != "requirement" and (not moved or len(charts) >= MAX_CHARTS):
            self.course.steady.append(figure)
            return
        for point in points:
            self.course.marks.setdefault(self.past[point.index].run, []).append((figure, point))
        verdict = self.verdicts.get(figure.name)
        title, limit = (verdict.label, first_number(verdict.limit)) if verdict else (figure.name, None)
        drawn = line_chart(title, figure.unit, self.nights, values, points, limit, f"t{len(charts)}")
        charts.append(
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
    return tuple(replace(point, index=start + point.index) for point in result) if start else result


def _moved(
    past: Sequence[Result], values: np.ndarray, figures: Sequence[Figure], tolerances: Tolerances
) -> dict[int, int]:
    """How many figures moved beyond their tolerance in each night, against the last night with a result."""
    rows = [i for i, r in enumerate(past) if r.home is not None]
    if len(rows) < 2:
        return {}
    size = np.max(np.abs(np.nan_to_num(values)), axis=0)
    limits = np.array([tolerances.of(f, float(s)) for f, s in zip(figures, size, strict=True)])
    steps = np.abs(np.diff(values[rows], axis=0)) > limits
    return {past[row].run: int(count) for row, count in zip(rows[1:], steps.sum(axis=1), strict=True)}
