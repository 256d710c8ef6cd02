"""The pages of the site: the index, and one page for each design with its trends and its nights."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from markupsafe import Markup

from actuator_lti.files.reading import Tree
from reports.charts import style
from reports.charts.chart import Chart
from reports.charts.svg import page_svg
from reports.html import render
from reports.nightly import changes
from reports.nightly.changes import Columns
from reports.nightly.figures import Figure
from reports.nightly.history import History
from reports.nightly.moves import LOOK_BACK, ChangePoint, change_points, flaps
from reports.nightly.records import Result
from reports.nightly.text import csv_text, one_line, to_seconds
from reports.nightly.view import STATES, DesignView, Overview, outcomes, report_folder
from reports.numbers import significant
from reports.scripts import asset, bundled
from reports.visible import visible

MAX_CHARTS = 60
DAY = 86400.0
_MAX_POINTS = 400
MAX_NIGHTS = 400
MAX_HEADLINES = 12
NIGHT_SIGNS = {
    "pass": ("✓", "passed"),
    "regressed": ("▼", "passed, closer to its limit"),
    "unproven": ("?", "not proven"),
    "fail": ("✗", "failed"),
    "error": ("⚠", "raised an error"),
    "timeout": ("⚠", "did not end in time"),
    "crash": ("⚠", "its process died"),
    "absent": ("·", "was not in the study"),
}


def index(night: Overview, folder: str) -> str:
    """Make the page that stands at the root of the site; its links lead into ``folder``."""
    shown = {"headlines": changes.headlines(night.designs)[:MAX_HEADLINES], "STATE_ORDER": tuple(STATES)}
    return _render("nightly/index.html", asset("nightly/nightly.js"), night=night, folder=folder, **shown)


def of_night(night: Overview, history: History, available: set[str]) -> Iterator[tuple[str, str]]:
    """Return the pages and tables of a night one after the other: file name and text."""
    for design in night.designs:
        yield f"{design.slug}.html", design_page(night, design, history, available)
        if not design.broken:  # every figure of tonight as a table for a spreadsheet
            figures = history.figures(design.result).values()
            rows = ((f.name, f.value, f.unit, f.kind) for f in figures)
            yield f"{design.slug}.csv", csv_text(("figure", "value", "unit", "kind"), rows)


def design_page(night: Overview, design: DesignView, history: History, available: set[str]) -> str:
    past = history.results(design.name)
    trend = trend_of(night, design, history, past)
    known, states, rows = {r.run: r for r in past}, outcomes(past), list[Tree]()
    gaps = {night.runs[i].id: count for i, count in night.missing}
    for run in reversed(night.runs):
        if (past and run.id < past[0].run) or len(rows) >= MAX_NIGHTS:
            break
        if run.id in gaps and run.id != night.run.id:
            rows.append({"gap": gaps[run.id]})
        result = known.get(run.id)
        folder = report_folder(result) if result is not None and result.key else ""
        row: Tree = {"gap": 0, "run": run, "result": result, "status": states.get(run.id, "absent")}
        row |= {"moved": trend.moved.get(run.id, 0), "marks": trend.marks.get(run.id, [])}
        approved = design.approval is not None and design.approval.run == run.id
        rows.append({**row, "report": folder if folder in available else "", "approved": approved})
    return _render(
        "nightly/design.html", bundled("figures"), night=night, design=design, charts=trend.charts,
        steady=trend.steady, nights=rows,
        more_nights=max(0, len(past) - MAX_NIGHTS), max_changes=changes.SHOWN_CHANGES,
    )  # fmt: skip


def _render(template: str, code: str, **context: Any) -> str:
    return render(
        template, style=asset("nightly/nightly.css"), code=code, states=STATES, night_signs=NIGHT_SIGNS,
        differences=changes, visible=visible, one_line=one_line, **context,
    )  # fmt: skip


# ---- one design over all its nights ---------------------------------------------------------------------


@dataclass
class Trend:
    """Charts for the page, figures without a change, change points and number of moves by night."""

    charts: list[Tree] = field(default_factory=list)
    steady: list[Figure] = field(default_factory=list)
    marks: dict[int, list[tuple[Figure, ChangePoint]]] = field(default_factory=dict)
    moved: dict[int, int] = field(default_factory=dict)


def trend_of(night: Overview, design: DesignView, history: History, past: Sequence[Result]) -> Trend:
    """Put together the trend of a design.

    Requirements are always charted; margins and other figures with a better side only where they moved.
    """
    good = [i for i, result in enumerate(past) if result.home is not None]
    if not good:
        return Trend()
    figures = list(history.figures(past[good[-1]]).values())
    columns = Columns(figures, night.study.tolerances)
    values = history.matrix(past, columns.names)
    moved = columns.moved(values[good[:-1]], values[good[1:]]).sum(axis=1).tolist()
    trend = Trend(moved={past[i].run: count for i, count in zip(good[1:], moved, strict=True)})
    size = np.max(np.abs(np.nan_to_num(values)), axis=0)
    allowed = columns.allowed(size, size).tolist()
    started = {run.id: run.started for run in night.runs}
    nights = [(result.run, started[result.run]) for result in past]
    verdicts = {f"{v['id']}: value": v for v in design.verdicts}
    for k in sorted(range(len(figures)), key=lambda k: figures[k].kind != "requirement"):
        figure = figures[k]
        shown = figure.kind in ("requirement", "check") or (figure.better and figure.kind == "figure")
        if shown and np.isfinite(values[:, k]).any():
            _add(trend, figure, verdicts.get(figure.name, {}), nights, values[:, k], allowed[k])
        elif figure.kind == "requirement":
            trend.steady.append(figure)  # of a loop that was never stable, say
    return trend


def _add(
    trend: Trend, figure: Figure, verdict: Tree, nights: Sequence[tuple[int, str]], values: np.ndarray,
    tolerance: float,
) -> None:  # fmt: skip
    skipped = max(len(values) - LOOK_BACK, 0)
    points = [replace(p, index=skipped + p.index) for p in change_points(values[skipped:], tolerance)]
    to_and_fro = flaps(values.tolist(), tolerance)
    moved = (points or to_and_fro) and len(trend.charts) < MAX_CHARTS
    if figure.kind != "requirement" and not moved:
        trend.steady.append(figure)
        return
    for point in points:
        trend.marks.setdefault(nights[point.index][0], []).append((figure, point))
    title, started = verdict.get("label", figure.name), [start for _, start in nights]
    limit, prefix = verdict.get("bound"), f"t{len(trend.charts)}"
    drawn = line_chart(title, figure.unit, started, values, points, limit, prefix)
    shown = [(started[p.index][:10], p) for p in points]
    about = {"title": title, "id": verdict.get("id", ""), "unit": figure.unit, "flaps": to_and_fro}
    trend.charts.append({**about, "svg": Markup(drawn), "points": shown})


def line_chart(
    title: str, unit: str, nights: Sequence[str], values: np.ndarray, points: Sequence[ChangePoint],
    limit: float | None = None, prefix: str = "t",
) -> str:  # fmt: skip
    """Draw a figure over the nights (texts of when each began; NaN: a night without the figure).

    Steps with gaps where there is none, lines at changes of level, the limit dashed.
    """
    chart = Chart(width=360.0, height=150.0)
    panel, days = chart.panel(), np.array([to_seconds(night) for night in nights]) / DAY
    first, last, span = float(days[0]), float(days[-1]), float(days[-1] - days[0])
    panel.x.days, panel.x.grid, panel.x.name = True, False, "night"
    panel.x.limits(first - 0.03 * max(span, 1.0), last + 0.03 * max(span, 1.0))
    ends = [(first + 0.1 * span, nights[0][:10]), (last - 0.1 * span, nights[-1][:10])]
    panel.x.ticks = ends if span >= 1.0 else [(0.5 * (first + last), nights[-1][:10])]  # of one day, once
    panel.y.name = f"value, {one_line(unit, 20)}" if unit else "value"
    if limit is not None:
        panel.rule_y(limit, "limit", seen=True, colour=style.RED, dash=1)
    for point in points:
        sign = "▲" if point.after > point.before else "▼"
        panel.rule_x(float(days[point.index]), sign, colour=style.ORANGE, dash=2)
    corners = _corners(values)
    up = np.repeat(values[corners], 2)[:-1]
    up[1::2][np.isnan(values[corners[1:]])] = np.nan  # no step into a gap
    panel.curve(np.repeat(days[corners], 2)[1:], up, colour=style.BLUE, width=1.8)
    finite = np.isfinite(values)
    padded = np.pad(finite, 1)
    alone = np.flatnonzero(finite & ~padded[:-2] & ~padded[2:])  # a line does not show them
    shown = [*alone.tolist(), int(np.flatnonzero(finite)[-1])]
    panel.points(days[shown], values[shown], colour=style.BLUE, size=4.0, read=False)
    there, after = values[finite], f" {unit}" if unit else ""
    now, low, high = (significant(float(x), 4) for x in (there[-1], there.min(), there.max()))
    words = f"{one_line(title, 120)}: {now}{after} in the last night"
    if len(there) > 1:
        words += f", between {low} and {high} over {len(there)} nights, {len(points)} change(s) of level"
    words += "" if limit is None else f"; limit {significant(limit, 4)}{after}"
    return page_svg(chart, prefix, words)


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
