"""The pages of the site: the index, and one page for each design with its trends and its nights."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from actuator_lti.files.tree import Tree
from reports.html import render
from reports.nightly.changes import SHOWN_CHANGES
from reports.nightly.course import Course, course_of
from reports.nightly.headline import cause_words, change_words, headlines, main_changes
from reports.nightly.history import History
from reports.nightly.machines import SIGNS, cause_lines
from reports.nightly.records import Result, Run
from reports.nightly.text import csv_text, one_line
from reports.nightly.view import STATE_WORDS, DesignView, Overview, outcome, report_folder
from reports.scripts import asset, bundled
from reports.visible import visible

MAX_NIGHTS = 400
MAX_HEADLINES = 12
STATES = {name: (SIGNS[name], words) for name, words in STATE_WORDS.items()}
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
    return _render(
        "nightly/index.html",
        asset("nightly/nightly.js"),
        night=night,
        folder=folder,
        STATE_ORDER=tuple(STATES),
        headlines=headlines(night.designs)[:MAX_HEADLINES],
    )


def of_night(night: Overview, history: History, available: set[str]) -> Iterator[tuple[str, str]]:
    """Return the pages and tables of a night one after the other: file name and text."""
    for design in night.designs:
        yield f"{design.slug}.html", design_page(night, design, history, available)
        if not design.broken:
            yield f"{design.slug}.csv", figures_csv(design, history)


def design_page(night: Overview, design: DesignView, history: History, available: set[str]) -> str:
    """Make the page of one design."""
    past = history.results(design.name)
    course = course_of(night, design, history, past)
    return _render(
        "nightly/design.html",
        bundled("figures"),
        night=night,
        design=design,
        charts=course.charts,
        steady=course.steady,
        marks=course.marks,
        nights=_nights(night, design, past, course, available),
        more_nights=max(0, len(past) - MAX_NIGHTS),
        max_changes=SHOWN_CHANGES,
    )


def figures_csv(design: DesignView, history: History) -> str:
    """Give every figure of tonight as a table for a spreadsheet."""
    figures = history.figures(design.result)
    rows = ((f.name, f.value, f.unit, f.kind) for f in figures.values())
    return csv_text(("figure", "value", "unit", "kind"), rows)


def _render(template: str, code: str, **context: Any) -> str:
    return render(
        template,
        style=asset("nightly/nightly.css"),
        code=code,
        states=STATES,
        night_signs=NIGHT_SIGNS,
        cause_lines=cause_lines,
        cause_words=cause_words,
        change_words=change_words,
        main_changes=main_changes,
        visible=visible,
        one_line=one_line,
        **context,
    )


def _nights(
    night: Overview, design: DesignView, past: list[Result], course: Course, available: set[str]
) -> list[Tree]:
    """Rows of the table of nights, the last first, with rows for nights that are missing."""
    known = {r.run: r for r in past}
    outcomes = {r.run: outcome(r, before) for r, before in zip(past, [None, *past], strict=False)}
    gaps = {night.runs[i].id: count for i, count in night.missing}
    first = past[0].run if past else 0
    rows: list[Tree] = []
    for run in reversed(night.runs):
        if run.id < first or len(rows) >= MAX_NIGHTS:
            break
        if run.id in gaps and run.id != night.run.id:
            rows.append({"gap": gaps[run.id]})
        status = outcomes.get(run.id, "absent")
        rows.append(_night(run, known.get(run.id), status, design, course, available))
    return rows


def _night(
    run: Run, result: Result | None, status: str, design: DesignView, course: Course, available: set[str]
) -> Tree:
    folder = report_folder(design.name, result.key) if result is not None and result.key else ""
    return {
        "gap": 0,  # of nights that are missing a row has nothing else
        "run": run,
        "result": result,
        "status": status,
        "report": folder if folder in available else "",
        "moved": course.moved.get(run.id, 0),
        "marks": course.marks.get(run.id, []),
        "approved": design.approval is not None and design.approval.run == run.id,
    }
