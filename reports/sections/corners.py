"""Margins at the corners: hot, cold, low supply, and the worst ends of the tolerances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from reports import document as doc
from reports.document_schema import Block, Row, Section
from reports.findings import Finding
from reports.sections.names import LOOPS

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from analyses.corners import Corner, Corners
    from analyses.loop_figures import LoopFigures


def of_design(design: Design) -> Section:
    """Make the section of a report."""
    from analyses.corners import corners

    return section(corners(design))


def section(result: Corners) -> Section:
    """Make the section from `analyses.corners.corners`."""
    intro = (
        "Each corner is a design of its own, put through the same sampled loops and the same requirements. "
        "The worst ends are those that one by one lower the margin of the loop where it is smallest, all "
        "taken together; the worst-case search of montecarlo looks inside the box as well."
    )
    rows = [_row(corner, name, one) for corner in result.corners for name, one in corner.figures.items()]
    words = [doc.text(f"{corner.name.capitalize()}: {corner.words}.") for corner in result.corners[1:]]
    blocks = [_summary_table(result), doc.details("Every loop at every corner", [_loop_table(rows), *words])]
    told = summary(result)
    severity: Literal["info", "warn"] = "info" if result.passed else "warn"
    return doc.section(
        "corners", "Corners", blocks, result=told, intro=intro, status="info" if result.passed else "warn",
        findings=[Finding(severity=severity, text=told, where="corners")],
    )  # fmt: skip


def summary(result: Corners) -> str:
    """Say at which corners the drive does not do."""
    failed = [corner.name for corner in result.corners if not corner.passed]
    if not failed:
        return f"Every loop is stable and every requirement met at all {len(result.corners)} corners."
    share = f"{len(failed)} of {len(result.corners)} corners"
    return f"Not every loop is stable and every requirement met at {share}: {'; '.join(failed)}."


def unmet(corner: Corner) -> str:
    """Name what a corner fails."""
    doubts = {name: one.margins.stable for name, one in corner.figures.items() if not one.stable}
    known = {None: "not known to be stable", False: "not stable"}
    loops = [f"{name} loop {known[stable]}" for name, stable in doubts.items()]
    return ", ".join([*loops, *(one.id for one in corner.verdicts if one.passed is False)])


def least(corner: Corner, attribute: str) -> tuple[float, str] | None:
    """The smallest margin over the loops, and its loop; None where there is none."""
    result = [
        (abs(value), name)
        for name, one in corner.figures.items()
        if one.stable and (value := getattr(one.margins, attribute)) is not None
    ]
    return min(result, default=None)


def _summary_table(result: Corners) -> Block:
    columns = [
        doc.column("corner", "Corner"),
        doc.column("gain", "Least gain margin", "dB", format="fix:1"),
        doc.column("gain_loop", "in"),
        doc.column("phase", "Least phase margin", "deg", format="fix:1"),
        doc.column("phase_loop", "in"),
        doc.column("unmet", "Not met"),
    ]
    rows = []
    for corner in result.corners:
        gain, phase = least(corner, "gain_margin_db"), least(corner, "phase_margin_deg")
        rows.append(
            {
                "corner": corner.name,
                "gain": gain and gain[0],
                "gain_loop": LOOPS[gain[1]] if gain else "",
                "phase": phase and phase[0],
                "phase_loop": LOOPS[phase[1]] if phase else "",
                "unmet": unmet(corner),
                "_status": None if corner.passed else "fail",
            }
        )
    note = "The least margin is that of the stable loops; others are named under what is not met."
    return doc.table("Corners", columns, rows, note)


def _loop_table(rows: list[Row]) -> Block:
    columns = [
        doc.column("corner", "Corner"),
        doc.column("loop", "Loop"),
        doc.column("stable", "Stable", format="yesno"),
        doc.column("gain", "Gain margin", "dB", format="fix:1"),
        doc.column("phase", "Phase margin", "deg", format="fix:1"),
        doc.column("bandwidth", "−3\N{NO-BREAK SPACE}dB bandwidth", "Hz", format="sig:3"),
    ]
    return doc.table("Loops at the corners", columns, rows)


def _row(corner: Corner, name: str, one: LoopFigures) -> Row:
    return {
        "corner": corner.name,
        "loop": LOOPS[name],
        "stable": one.stable,
        "gain": one.margins.gain_margin_db,
        "phase": one.margins.phase_margin_deg,
        "bandwidth": one.bandwidth.minus3db_hz if one.bandwidth else None,
    }
