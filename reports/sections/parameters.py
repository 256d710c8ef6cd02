"""The values of the design with their sources, and what the report was made of and with."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from actuator_lti.asked.quantities import unit_words
from actuator_lti.design.model import Design, Parameter
from actuator_lti.design.units import ampere_unit
from reports import document as doc
from reports.numbers import short

_ENDLESS = re.compile(r"-?\d*\.\d{12,}(e-?\d+)?")
GRADES = (
    "Grades: A maker's document or standard text; B file of a real device or a consistent second source; "
    "C community transcription; D derived; X assumed, to be replaced by whoever has the figure."
)
NO_RECORD = "The design carries no record of where its values come from."


def _columns(design: Design) -> list[doc.Shown]:
    constants = design.motor.constants
    return [
        doc.of("path", "path", "Key"),
        doc.of("symbol", "symbol", "Symbol"),
        doc.of(lambda item: _written(item.text), "text", "As written"),
        doc.of("value", "value", "In SI", format="short:6"),
        doc.of(lambda item: unit_words(ampere_unit(item.path, item.unit, constants)), "unit", "Unit"),
        doc.of("grade", "grade", "Grade"),
        doc.of(lambda item: tolerance_words(item), "tolerance", "Tolerance"),
        doc.of("source", "source", "Source"),
    ]


_OF_FACTS = {"label": "What", "value": "Value", "grade": "Grade", "source": "Source"}
FACTS = [doc.of(name, name, heading) for name, heading in _OF_FACTS.items()]


def section(design: Design, warnings: Sequence[str] = ()) -> doc.Section:
    parameters = list(design.parameters.values())
    assumed = sum("X" in item.grade for item in parameters)
    blocks: list[doc.Block] = [_derived(design)]
    if warnings:
        column = doc.of(str, "warning", "Warning")
        blocks.append(doc.listing("To be checked", warnings, [column], status=lambda _: "warn"))
    if parameters:
        blocks.append(doc.listing("Values of the design file", parameters, _columns(design)))
    if design.facts:
        facts = doc.listing("Facts", design.facts, FACTS)
        blocks.append(doc.details("Facts that enter no equation", [facts]))
    findings = [doc.Finding(severity="warn", text=f"{words}.", where="parameters") for words in warnings]
    ungraded, result = sum(not item.grade for item in parameters), NO_RECORD
    if parameters:
        result = f"{len(parameters)} values; {assumed} of them assumed (grade X), {ungraded} without a grade."
    if assumed:
        text = f"{assumed} of {len(parameters)} values are assumed."
        findings.append(doc.Finding(severity="info", text=text, where="parameters"))
    return doc.section(
        "parameters", "Parameters and their sources", blocks, result=result,
        intro=GRADES if parameters else "", status="warn" if warnings else "info", findings=findings,
    )  # fmt: skip


def _derived(design: Design) -> doc.Block:
    mass, unit = ("Inertia at the motor", "kg m²") if design.axis == "rotary" else ("Moving mass", "kg")
    items = (
        ("Total reduction N", float(f"{design.total_ratio:.6g}")),
        (mass, design.inertia_kgm2, unit),
        ("Tick of the controller", design.controller.period_s * 1e6, "µs"),
        ("Computing delay", design.controller.computing_delay_s * 1e6, "µs"),
        ("Friction law", design.friction.law),
        ("Load path", design.load.path),
    )
    return doc.facts(doc.fact(*item) for item in items)


def _written(text: str) -> str:
    """A value that was derived has all its digits: six are enough to read."""
    number, gap, unit = text.partition(" ")
    return f"{short(float(number), 6)}{gap}{unit}" if _ENDLESS.fullmatch(number) else text


def tolerance_words(item: Parameter) -> str:
    """Write a tolerance: half width of a uniform one, standard deviation of a normal one."""
    tolerance = item.tolerance
    if tolerance is None:
        return ""
    text = tolerance.text or f"{tolerance.width:.3g}"
    return f"±{text}" if tolerance.kind == "uniform" else f"σ {text}, {tolerance.kind}"


def provenance(design: Mapping[str, Any], head: Mapping[str, Any], *, checked: bool = True) -> doc.Section:
    """Make the section; it says, too, where the report is not ``checked`` by simulation."""
    rows = {
        "design": f"{design['name']}, revision {design['revision'] or 'none'}",
        "design file": design["origin"] or "none",
        "hash of the design (SHA-256)": head["design_hash"],
        "actuator-lti": head["version"],
        "commit": head["commit"] or "not built from a git tree",
        "built": head["time"],
        "Python": f"{head['python']}, {head['platform']}",
        **head["libraries"],
    }
    columns = [doc.column("what", "What"), doc.column("value", "Value")]
    table = doc.table("Design, program and libraries", columns, rows.items())
    program, short_hash = f"actuator-lti {head['version']}", head["design_hash"][:12]
    words = f"Computed by {program} from the design with hash {short_hash}."
    blocks = [doc.details("To build this report again", [table])]
    text = "No simulation stands behind this report: friction, limits and large commands are not checked."
    findings = [] if checked else [doc.Finding(severity="warn", text=text, where="provenance")]
    return doc.section("provenance", "Provenance", blocks, result=words, findings=findings)
