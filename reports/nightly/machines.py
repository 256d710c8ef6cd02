"""A night for machines: JUnit XML, ``summary.json`` and a Markdown summary for a pull request."""

from dataclasses import asdict
from xml.etree import ElementTree as Xml

from actuator_lti.files.reading import Tree
from reports.html import environment
from reports.nightly import changes
from reports.nightly.changes import Comparison, cause_lines
from reports.nightly.text import markdown_cell, one_line
from reports.nightly.view import STATES, DesignView, Overview
from reports.numbers import or_none
from reports.visible import visible

SCHEMA = "actuator-lti/nightly"
VERSION = 2
_MAX_TEXT = 20_000
_LISTED = 20
_OF_REQUIREMENT = ("id", "label", "value", "limit", "unit", "distance", "verdict", "waiver")
_OF_CHANGE = ("figure", "unit", "before", "after", "tolerance", "worse", "flapping")


def summary(night: Overview) -> Tree:
    run = night.run
    return {
        "schema": SCHEMA,
        "version": VERSION,
        "study": night.study.name,
        "run": run.id,
        "started": run.started,
        "finished": run.finished,
        "code": {"hash": run.code, "commit": run.code_commit, "libraries": dict(run.libraries)},
        "study_commit": run.study_commit,
        "history": asdict(night.memory),
        "exit_status": int(not night.passed),
        "counts": {state: night.count(state) for state in STATES},
        "gone": list(night.gone),
        "designs": [_design(d) for d in night.designs],
    }


def _design(design: DesignView) -> Tree:
    result, approval = design.result, design.approval
    return {
        **{name: getattr(result, name) for name in ("name", "kind", "status", "failed", "total", "cached")},
        "state": design.state,
        "message": design.why,
        "worst_requirement": result.worst_id or None,
        "worst_relative_distance": result.worst,
        "flapping": design.status_flaps,
        "report": None if design.broken else f"{design.report}/report.html",
        "requirements": [{name: v[name] for name in _OF_REQUIREMENT} for v in design.verdicts],
        "changes_since_last_night": _comparison(design.last_night),
        "changes_since_baseline": _comparison(design.baseline),
        "approved_by": approval.by if approval else None,
        "approved_because": approval.reason if approval else None,
    }


def _comparison(comparison: Comparison) -> Tree:
    return {
        "run": comparison.run.id if comparison.run else None,
        "note": comparison.note,
        "figures": [{name: getattr(c, name) for name in _OF_CHANGE} for c in comparison.changes],
        "behind_it": cause_lines(comparison.cause),
    }


def junit(night: Overview) -> str:
    """JUnit XML: a suite a design, a case a requirement, one for its build and one for regressions."""
    top = Xml.Element("testsuites", name=_line(night.study.name))
    for design in night.designs:
        took, began = f"{design.result.seconds:.3f}", night.run.started.rstrip("Z")
        about = {"name": _line(design.name), "time": took, "timestamp": began}
        _cases(Xml.SubElement(top, "testsuite", about), design)
    for name in map(_line, night.gone):
        about = {"classname": name, "name": "is in the study"}
        case = Xml.SubElement(Xml.SubElement(top, "testsuite", name=name), "testcase", about)
        Xml.SubElement(case, "skipped", message="in the study last night, not tonight")
    tags = {"tests": "testcase", "failures": "failure", "errors": "error", "skipped": "skipped"}
    for element in (*top, top):
        for name, tag in tags.items():
            element.set(name, str(len(element.findall(f".//{tag}"))))
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{Xml.tostring(top, encoding="unicode")}\n'


def _cases(suite: Xml.Element, design: DesignView) -> None:
    def case(name: str, tag: str = "", message: str = "", kind: str = "", text: str = "") -> None:
        one = Xml.SubElement(suite, "testcase", classname=_line(design.name), name=_line(name))
        if tag:
            about = {"type": kind} if kind else {}
            Xml.SubElement(one, tag, about, message=_line(message)).text = visible(text)[:_MAX_TEXT]

    if design.broken:
        case("is built", "error", design.why, design.result.status, design.result.message.partition("\n")[2])
        return
    case("is built")
    worse = design.baseline.regressions
    lines = [f"{c.figure}: {_value(c.before)} -> {_value(c.after)} {c.unit}" for c in worse]
    text = "\n".join([*lines, *cause_lines(design.baseline.cause)])
    message = f"{len(worse)} figure(s) worse than {design.held_against}"
    case("no unapproved regression", "failure" * bool(worse), message, "regression", text)
    for v in design.verdicts:
        name = f"{v['id']} {v['label']}" if v["label"] != v["id"] else v["id"]
        found = (
            f"found {_value(v['value'])}, limit {v['limit']}, distance {_value(v['distance'])} {v['unit']}"
        )
        if v["verdict"] == "met" or v["waiver"]:
            case(name, "skipped" * (v["verdict"] != "met"), v["why"])
        elif v["verdict"] == "not met":
            case(name, "failure", found, "requirement", v["reason"])
        else:
            case(name, "failure", "not proven", "not proven", v["reason"])
    for title in design.meta.get("failed_sections", ()):
        case(f"section {title}", "failure", "does not pass", "section")


def _line(text: str) -> str:
    return one_line(text, _MAX_TEXT)


def _value(value: float | None) -> str:
    return "none" if value is None else f"{value:.6g}"


def markdown(night: Overview) -> str:
    """Summary for a pull request: verdict first, then what fails, what changed and what is behind it."""
    notable = [d for d in night.designs if d.state != "pass" or d.last_night.changes]
    shown = {"differences": changes, "states": STATES, "cell": markdown_cell, "or_none": or_none}
    template = environment().get_template("nightly/summary.md.j2")
    return template.render(night=night, notable=notable, listed=_LISTED, **shown)
