"""One design over all its nights: its charts, what never moved, and what happened in which night."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from markupsafe import Markup

from actuator_lti.files.tree import Tree
from reports.nightly.changes import Columns
from reports.nightly.charts import line_chart
from reports.nightly.figures import Figure, Verdict, first_number
from reports.nightly.history import History
from reports.nightly.records import Result
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
        title, limit = (verdict.label, first_number(verdict.limit)) if verdict else (figure.name, None)
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
