"""A night for machines: JUnit XML, ``summary.json`` and a Markdown summary for a pull request."""

from __future__ import annotations

import json
from typing import TypedDict
from xml.sax.saxutils import escape, quoteattr

from actuator_lti.tree import Tree
from reports.nightly.changes import Cause, Change, Comparison
from reports.nightly.figures import Verdict
from reports.nightly.text import markdown_cell, one_line
from reports.nightly.view import DesignView, Overview
from reports.numbers import significant
from reports.visible import visible

SCHEMA = "actuator-lti/nightly"
VERSION = 2
_MAX_TEXT = 20_000
_LISTED = 20
STATE_WORDS = {
    "broken": "no result",
    "fail": "failing",
    "unproven": "not proven",
    "regression": "regressed",
    "pass": "passing",
}
SIGNS = {"broken": "⚠", "fail": "✗", "unproven": "?", "regression": "▼", "pass": "✓"}


class RequirementJson(TypedDict):
    """A requirement of a design, as `Verdict`."""

    id: str
    label: str
    value: float | None
    limit: str
    unit: str
    distance: float | None
    verdict: str
    waiver: str


class ChangeJson(TypedDict):
    """A figure that moved, as `Change`."""

    figure: str
    unit: str
    before: float | None
    after: float | None
    tolerance: float
    worse: bool | None
    flapping: bool


class ComparisonJson(TypedDict):
    """A design against an earlier night."""

    run: int | None
    note: str
    figures: list[ChangeJson]
    behind_it: list[str]


class DesignJson(TypedDict):
    """What came of one design."""

    name: str
    kind: str
    state: str
    status: str
    message: str
    failed: int
    total: int
    worst_requirement: str | None
    worst_relative_distance: float | None
    flapping: bool
    cached: bool
    report: str | None
    requirements: list[RequirementJson]
    changes_since_last_night: ComparisonJson
    changes_since_baseline: ComparisonJson
    approved_by: str | None
    approved_because: str | None


class CodeJson(TypedDict):
    """What computed the night."""

    hash: str
    commit: str
    libraries: dict[str, str]


class NightJson(TypedDict):
    """``summary.json``."""

    schema: str
    version: int
    study: str
    run: int
    started: str
    finished: str | None
    code: CodeJson
    study_commit: str
    history: Tree
    exit_status: int
    counts: dict[str, int]
    gone: list[str]
    designs: list[DesignJson]


def summary(night: Overview) -> NightJson:
    """What came of a night, as plain JSON."""
    return {
        "schema": SCHEMA,
        "version": VERSION,
        "study": night.study,
        "run": night.run.id,
        "started": night.run.started,
        "finished": night.run.finished,
        "code": {
            "hash": night.run.code,
            "commit": night.run.code_commit,
            "libraries": dict(night.run.libraries),
        },
        "study_commit": night.run.study_commit,
        "history": night.memory.plain(),
        "exit_status": night.exit_status,
        "counts": {state: night.count(state) for state in STATE_WORDS},
        "gone": list(night.gone),
        "designs": [_design(d) for d in night.designs],
    }


def summary_text(night: Overview) -> str:
    """The same as text."""
    return json.dumps(summary(night), ensure_ascii=True, allow_nan=False, indent=1) + "\n"


def _design(design: DesignView) -> DesignJson:
    result = design.result
    return {
        "name": design.name,
        "kind": result.kind,
        "state": design.state,
        "status": result.status,
        "message": result.message.partition("\n")[0],
        "failed": result.failed,
        "total": result.total,
        "worst_requirement": result.worst_id or None,
        "worst_relative_distance": result.worst,
        "flapping": design.status_flaps,
        "cached": result.cached,
        "report": None if design.broken else f"{design.report}/report.html",
        "requirements": [_requirement(v) for v in design.verdicts],
        "changes_since_last_night": _comparison(design.last_night),
        "changes_since_baseline": _comparison(design.baseline),
        "approved_by": design.approval.by if design.approval else None,
        "approved_because": design.approval.reason if design.approval else None,
    }


def _requirement(verdict: Verdict) -> RequirementJson:
    return {
        "id": verdict.id,
        "label": verdict.label,
        "value": verdict.value,
        "limit": verdict.limit,
        "unit": verdict.unit,
        "distance": verdict.distance,
        "verdict": verdict.verdict,
        "waiver": verdict.waiver,
    }


def _comparison(comparison: Comparison) -> ComparisonJson:
    return {
        "run": comparison.run.id if comparison.run else None,
        "note": comparison.note,
        "figures": [_change(c) for c in comparison.changes],
        "behind_it": cause_lines(comparison.cause),
    }


def _change(change: Change) -> ChangeJson:
    return {
        "figure": change.figure,
        "unit": change.unit,
        "before": change.before,
        "after": change.after,
        "tolerance": change.tolerance,
        "worse": change.worse,
        "flapping": change.flapping,
    }


def cause_lines(cause: Cause) -> list[str]:
    """What lies behind a change, one line each."""
    lines = [f"parameter {name}: {old} → {new}" for name, old, new in cause.parameters]
    lines += [f"setting {name}: {old} → {new}" for name, old, new in cause.settings]
    lines += [f"library {name}: {old} → {new}" for name, old, new in cause.libraries]
    lines += [f"commit ({where}) {line}" for where, line in cause.commits]
    if cause.code and not cause.commits and not cause.libraries:
        lines.append("sources of actuator-lti changed without a commit")
    return lines


def junit(night: Overview) -> str:
    """JUnit XML: a suite a design, a case a requirement, one for its build and one for regressions."""
    suites = [_suite(d, night) for d in night.designs]
    totals = [sum(part[1][k] for part in suites) for k in range(4)]
    head = (
        f'<testsuites name={_attribute(night.study)} tests="{totals[0]}" failures="{totals[1]}"'
        f' errors="{totals[2]}" skipped="{totals[3]}">'
    )
    body = "\n".join(part[0] for part in suites)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{head}\n{body}\n</testsuites>\n'


def _suite(design: DesignView, night: Overview) -> tuple[str, tuple[int, int, int, int]]:
    name = _attribute(design.name)
    cases = [_build_case(design)]
    if not design.broken:
        cases.append(_regression_case(design))
        cases += [_requirement_case(design, v) for v in design.verdicts]
        cases += [_section_case(design, title) for title in design.failed_sections]
    counts = [len(cases), *(sum(f"<{tag} " in c for c in cases) for tag in ("failure", "error", "skipped"))]
    tests, failures, errors, skipped = counts
    head = (
        f'<testsuite name={name} tests="{tests}" failures="{failures}" errors="{errors}" skipped="{skipped}"'
        f' time="{design.result.seconds:.3f}" timestamp="{night.run.started.rstrip("Z")}">'
    )
    return head + "\n" + "\n".join(cases) + "\n</testsuite>", (tests, failures, errors, skipped)


def _case(design: DesignView, name: str, inside: str = "") -> str:
    head = f"<testcase classname={_attribute(design.name)} name={_attribute(name)}"
    return f"{head}>{inside}</testcase>" if inside else f"{head}/>"


def _build_case(design: DesignView) -> str:
    if not design.broken:
        return _case(design, "is built")
    first, _, rest = design.result.message.partition("\n")
    inside = (
        f"<error type={_attribute(design.result.status)} message={_attribute(first)}>{_text(rest)}</error>"
    )
    return _case(design, "is built", inside)


def _regression_case(design: DesignView) -> str:
    worse = design.regressions
    if not worse:
        return _case(design, "no unapproved regression")
    lines = [f"{c.figure}: {_value(c.before)} -> {_value(c.after)} {c.unit}" for c in worse]
    lines += cause_lines(design.baseline.cause)
    message = _attribute(f"{len(worse)} figure(s) worse than the baseline")
    inside = f'<failure type="regression" message={message}>{_text(chr(10).join(lines))}</failure>'
    return _case(design, "no unapproved regression", inside)


def _requirement_case(design: DesignView, verdict: Verdict) -> str:
    name = f"{verdict.id} {verdict.label}" if verdict.label != verdict.id else verdict.id
    result = (
        f"found {_value(verdict.value)}, limit {verdict.limit}, "
        f"distance {_value(verdict.distance)} {verdict.unit}"
    )
    if verdict.verdict == "met":
        return _case(design, name)
    if verdict.waiver:
        return _case(design, name, f"<skipped message={_attribute(verdict.why)}/>")
    message = result if verdict.verdict == "not met" else "not proven"
    kind = "requirement" if verdict.verdict == "not met" else "not proven"
    inside = f'<failure type="{kind}" message={_attribute(message)}>{_text(verdict.reason)}</failure>'
    return _case(design, name, inside)


def _section_case(design: DesignView, title: str) -> str:
    return _case(design, f"section {title}", '<failure type="section" message="does not pass"></failure>')


def _attribute(text: str) -> str:
    return quoteattr(one_line(text, _MAX_TEXT))


def _text(text: str) -> str:
    return escape(visible(text)[:_MAX_TEXT])


def _value(value: float | None) -> str:
    return "none" if value is None else f"{value:.6g}"


def markdown(night: Overview) -> str:
    """Summary for a pull request: verdict first, then what fails, what changed and what is behind it."""
    counts = ", ".join(
        f"{night.count(state)} {words}" for state, words in STATE_WORDS.items() if night.count(state)
    )
    sign = "✓" if night.exit_status == 0 else "✗"
    lines = [f"## {sign} Nightly {markdown_cell(night.title)}: {counts}", ""]
    lines += [
        f"Run {night.run.id}, {night.run.started}, study commit {night.run.study_commit[:12] or 'unknown'}.",
        "",
    ]
    notable = [d for d in night.designs if d.state != "pass" or d.last_night.changes]
    if notable:
        lines += [
            "| design | state | worst requirement | distance | moved since last night |",
            "|---|---|---|---:|---:|",
        ]
        lines += [_row(d) for d in notable[:_LISTED]]
        if len(notable) > _LISTED:
            lines.append(f"| and {len(notable) - _LISTED} more | | | | |")
    else:
        lines.append("Nothing moved since last night.")
    for design in notable[:_LISTED]:
        lines += _details(design)
    return "\n".join(lines) + "\n"


def _row(design: DesignView) -> str:
    worst = "" if design.result.worst is None else f"{100 * design.result.worst:+.1f} %"
    state = f"{SIGNS[design.state]} {STATE_WORDS[design.state]}"
    cells = (markdown_cell(design.name), state, markdown_cell(design.result.worst_id), worst)
    return f"| {' | '.join(cells)} | {len(design.last_night.changes)} |"


def _details(design: DesignView) -> list[str]:
    lines = [_moved(c) for c in design.last_night.changes[:8]]
    lines += [f"- {markdown_cell(line, 200)}" for line in cause_lines(design.last_night.cause)[:8]]
    if design.broken:
        first = design.result.message.partition("\n")[0]
        lines.append(f"- {design.result.status}: {markdown_cell(first, 200)}")
    return ["", f"**{markdown_cell(design.name)}**", "", *lines] if lines else []


def _moved(change: Change) -> str:
    marks = (" (worse)" if change.worse else "") + (" (flapping)" if change.flapping else "")
    values = f"{_short(change.before)} → {_short(change.after)} {markdown_cell(change.unit)}"
    return f"- {markdown_cell(change.figure, 120)}: {values}{marks}"


def _short(value: float | None) -> str:
    return "none" if value is None else significant(value, 4)
