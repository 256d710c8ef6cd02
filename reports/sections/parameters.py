"""Every value of the design file with its source, grade and tolerance."""

from __future__ import annotations

from collections.abc import Sequence

from actuator_lti.design.model import Design, Parameter
from reports import document as doc
from reports.document_schema import Block, Section, Status
from reports.findings import Finding
from reports.sections.names import unit_words

GRADES = (
    "Grades: A maker's document or standard text; B file of a real device or a consistent second source; "
    "C community transcription; D derived; X assumed, to be replaced by whoever has the figure."
)
COLUMNS = [
    doc.of("path", "path", "Key"),
    doc.of("symbol", "symbol", "Symbol"),
    doc.of("text", "text", "As written"),
    doc.of("value", "value", "In SI", format="short:6"),
    doc.of(lambda item: unit_words(item.unit), "unit", "Unit"),
    doc.of("grade", "grade", "Grade"),
    doc.of(lambda item: tolerance_words(item), "tolerance", "Tolerance"),
    doc.of("source", "source", "Source"),
]
FACTS = [
    doc.of("label", "label", "What"),
    doc.of("value", "value", "Value"),
    doc.of("grade", "grade", "Grade"),
    doc.of("source", "source", "Source"),
]


def section(design: Design, warnings: Sequence[str] = ()) -> Section:
    """Make the section."""
    parameters = list(design.parameters.values())
    assumed = sum("X" in item.grade for item in parameters)
    blocks: list[Block] = [_derived(design)]
    if warnings:
        rows = [{"warning": warning, "_status": "warn"} for warning in warnings]
        blocks.append(doc.table("To be checked", [doc.column("warning", "Warning")], rows))
    if parameters:
        blocks.append(doc.listing("Values of the design file", parameters, COLUMNS))
    if design.facts:
        facts = doc.listing("Facts", design.facts, FACTS)
        blocks.append(doc.details("Facts that enter no equation", [facts]))
    status: Status = "warn" if warnings else "info"
    findings = [Finding(severity="warn", text=words, where="parameters") for words in warnings]
    result = (
        f"{len(parameters)} values; {assumed} of them are assumed (grade X)."
        if parameters
        else "The design carries no record of where its values come from."
    )
    if assumed:
        told = f"{assumed} of {len(parameters)} values are assumed."
        findings.append(Finding(severity="info", text=told, where="parameters"))
    return doc.section(
        "parameters", "Parameters and their sources", blocks, result=result,
        intro=GRADES if parameters else "",
        status=status, findings=findings,
    )  # fmt: skip


def _derived(design: Design) -> Block:
    """Give what follows from the values."""
    mass, unit = ("Inertia at the motor", "kg m²") if design.axis == "rotary" else ("Moving mass", "kg")
    items = [
        doc.fact("Total reduction N", float(f"{design.total_ratio:.6g}")),
        doc.fact(mass, design.inertia_kgm2, unit),
        doc.fact("Tick of the controller", design.controller.period_s * 1e6, "µs"),
        doc.fact("Computing delay", design.controller.computing_delay_s * 1e6, "µs"),
        doc.fact("Friction law", design.friction.law),
        doc.fact("Load path", design.load.path),
    ]
    return doc.facts(items)


def tolerance_words(item: Parameter) -> str:
    """Write a tolerance: half width of a uniform one, standard deviation of a normal one."""
    tolerance = item.tolerance
    if tolerance is None:
        return ""
    width = tolerance.half_width if tolerance.kind == "uniform" else tolerance.std
    text = tolerance.text or ("" if width is None else f"{width:.3g}")
    return f"±{text}" if tolerance.kind == "uniform" else f"σ {text}, {tolerance.kind}"
