"""Every value of the design file with its source, grade and tolerance."""

from __future__ import annotations

from collections.abc import Sequence

from actuator_lti.design.model import Design, Parameter
from reports import document as doc
from reports.document_schema import Block, Row, Section, Status
from reports.findings import Finding

GRADES = (
    "Grades: A maker's document or standard text; B file of a real device or a consistent second source; "
    "C community transcription; D derived; X assumed, to be replaced by whoever has the figure."
)
COLUMNS = [
    doc.column("path", "Key"),
    doc.column("symbol", "Symbol"),
    doc.column("text", "As written"),
    doc.column("value", "In SI", format="short:6"),
    doc.column("unit", "Unit"),
    doc.column("grade", "Grade"),
    doc.column("tolerance", "Tolerance"),
    doc.column("source", "Source"),
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
        blocks.append(doc.table("Values of the design file", COLUMNS, [_row(item) for item in parameters]))
    if design.facts:
        columns = [doc.column("label", "What"), doc.column("value", "Value")]
        columns += [doc.column("grade", "Grade"), doc.column("source", "Source")]
        rows = [
            {"label": f.label, "value": f.value, "grade": f.grade, "source": f.source} for f in design.facts
        ]
        blocks.append(doc.details("Facts that enter no equation", [doc.table("Facts", columns, rows)]))
    status: Status = "warn" if warnings else "info"
    findings = [Finding(severity="warn", text=words, where="parameters") for words in warnings]
    result = (
        f"{len(parameters)} values; {assumed} of them are assumed (grade X)."
        if parameters
        else "The design carries no record of where its values come from."
    )
    if assumed:
        findings.append(
            Finding(
                severity="info",
                text=f"{assumed} of {len(parameters)} values are assumed.",
                where="parameters",
            )
        )
    return doc.section(
        "parameters", "Parameters and their sources", blocks, result=result,
        intro=GRADES if parameters else "",
        status=status, findings=findings,
    )  # fmt: skip


def _derived(design: Design) -> Block:
    """Give what follows from the values."""
    rotary = design.axis == "rotary"
    items = [
        doc.fact("Total reduction N", float(f"{design.total_ratio:.6g}")),
        doc.fact(
            "Inertia at the motor" if rotary else "Moving mass",
            design.inertia_kgm2,
            "kg m²" if rotary else "kg",
        ),
        doc.fact("Tick of the controller", design.controller.period_s * 1e6, "µs"),
        doc.fact("Computing delay", design.controller.computing_delay_s * 1e6, "µs"),
        doc.fact("Friction law", design.friction.law),
        doc.fact("Load path", design.load.path),
    ]
    return doc.facts(items)


def _row(item: Parameter) -> Row:
    return {
        "path": item.path,
        "symbol": item.symbol,
        "text": item.text,
        "value": item.value,
        "unit": "" if item.unit == "1" else item.unit,
        "grade": item.grade,
        "tolerance": tolerance_words(item),
        "source": item.source,
    }


def tolerance_words(item: Parameter) -> str:
    """Write a tolerance: half width of a uniform one, standard deviation of a normal one."""
    tolerance = item.tolerance
    if tolerance is None:
        return ""
    width = tolerance.half_width if tolerance.kind == "uniform" else tolerance.std
    text = tolerance.text or ("" if width is None else f"{width:.3g}")
    return f"±{text}" if tolerance.kind == "uniform" else f"σ {text}, {tolerance.kind}"
