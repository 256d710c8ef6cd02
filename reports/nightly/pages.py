"""The pages of the site: the index, and one page for each design with its trends and its nights."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from actuator_lti.files.tree import Tree
from reports.html import render
from reports.nightly.changes import SHOWN_CHANGES
from reports.nightly.course import Course, course_of
from reports.nightly.headline import cause_lines, cause_words, change_words, headlines, main_changes
from reports.nightly.history import History
from reports.nightly.records import Result
from reports.nightly.text import csv_text, one_line
from reports.nightly.view import STATES, DesignView, Overview, outcomes, report_folder
from reports.scripts import asset, bundled
from reports.visible import visible

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
        if not design.broken:  # every figure of tonight as a table for a spreadsheet
            figures = history.figures(design.result).values()
            rows = ((f.name, f.value, f.unit, f.kind) for f in figures)
            yield f"{design.slug}.csv", csv_text(("figure", "value", "unit", "kind"), rows)


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
        nights=_nights(night, design, past, course, available),
        more_nights=max(0, len(past) - MAX_NIGHTS),
        max_changes=SHOWN_CHANGES,
    )


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
    """Rows of the table of nights, the last first, with rows for nights that are missing (``gap``)."""
    known, states = {r.run: r for r in past}, outcomes(past)
    gaps = {night.runs[i].id: count for i, count in night.missing}
    rows: list[Tree] = []
    for run in reversed(night.runs):
        if (past and run.id < past[0].run) or len(rows) >= MAX_NIGHTS:
            break
        if run.id in gaps and run.id != night.run.id:
            rows.append({"gap": gaps[run.id]})
        result = known.get(run.id)
        folder = report_folder(result) if result is not None and result.key else ""
        rows.append(
            {
                "gap": 0,
                "run": run,
                "result": result,
                "status": states.get(run.id, "absent"),
                "report": folder if folder in available else "",
                "moved": course.moved.get(run.id, 0),
                "marks": course.marks.get(run.id, []),
                "approved": design.approval is not None and design.approval.run == run.id,
            }
        )
    return rows
