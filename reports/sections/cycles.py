"""Limit cycles of play and quantisation: predicted by describing function, then sought by simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from analyses.motion.settling import words
from reports import document as doc
from reports.document_schema import Block, Row, Section
from reports.findings import Finding
from reports.sections.large_signal import load_unit, output_unit

if TYPE_CHECKING:
    from analyses.limit_cycles import Confirmation, LimitCycles
    from analyses.motion.settling import Settling

CAUSES = {
    "play": "play",
    "quantisation": "quantised output sensor",
    "motor-quantisation": "quantised motor encoder",
}


def section(result: LimitCycles) -> Section:
    """Make the section from `analyses.limit_cycles.limit_cycles`."""
    scale, unit = output_unit(result.design)
    fine, small = 1e3 * scale, {"deg": "mdeg", "mm": "µm"}[unit]
    intro = (
        "Play acts for a sinusoidal twist as a softer coupling, a sensor's count for a small swing about its "
        "edge as a relay. A cycle is predicted where the sampled loop with that gain keeps an oscillation's "
        "size, then the simulator is started in its shape at many sizes. Cycles of dry friction alone stand "
        "under Dry friction at small signals."
    )
    blocks: list[Block] = []
    if result.confirmations:
        blocks.append(_predicted(result, fine, small))
    else:
        causes = (
            " or ".join(CAUSES[name] for name in result.looked_for) or "play or a quantised output sensor"
        )
        blocks.append(doc.text(f"No limit cycle of {causes} is predicted."))
    blocks.append(_rests(result, fine, small))
    text = summary(result)
    severity: Any = "info" if result.hunting is None else "warn"
    return doc.section(
        "cycles", "Limit cycles", blocks, result=text, intro=intro, status=severity,
        findings=[Finding(severity=severity, text=text, where="cycles")],
    )  # fmt: skip


def summary(result: LimitCycles) -> str:
    """Say whether the drive as it is comes to rest."""
    scale, unit = output_unit(result.design)
    fine, small = 1e3 * scale, {"deg": "mdeg", "mm": "µm"}[unit]
    swing, count = result.hunting, len(result.confirmations)
    seen = sum(one.verdict == "confirmed" for one in result.confirmations)
    tail = f"; {seen} of {count} predicted cycles confirmed" if count else "; none is predicted"
    if swing is None:
        return f"The drive as it is comes to rest after every step{tail}."
    at = f"{swing.load_Nm:g} {load_unit(result.design)}"
    return f"The drive as it is does not come to rest: {words(swing.rest, fine, small)} under {at}{tail}."


def _predicted(result: LimitCycles, fine: float, small: str) -> Block:
    columns = [
        doc.column("cause", "Cause"),
        doc.column("friction", "Dry friction"),
        doc.column("kind", "Kind"),
        doc.column("size", "Predicted, peak", small, format="sig:3", better=-1),
        doc.column("hz", "at", "Hz", format="sig:3"),
        doc.column("seen", "Simulated", small, format="sig:3"),
        doc.column("seen_hz", "at", "Hz", format="sig:3"),
        doc.column("verdict", "Verdict"),
    ]
    note = (
        "Attracting: motion near it ends in it. Border: smaller motion dies out, larger grows. Friction left "
        "out or by its own describing function, as the column says; no limit acts."
    )
    rows = [_row(one, fine) for one in result.confirmations]
    return doc.table("Predicted limit cycles, at the output", columns, rows, note)


def _row(one: Confirmation, fine: float) -> Row:
    cycle = one.cycle
    return {
        "cause": CAUSES[cycle.cause],
        "friction": "in it" if cycle.with_friction else "left out",
        "kind": "attracting" if cycle.stable else "border",
        "size": fine * cycle.output_rad,
        "hz": cycle.frequency_hz,
        "seen": None if one.ratio is None else fine * one.ratio * cycle.output_rad,
        "seen_hz": one.frequency_hz,
        "verdict": one.verdict,
    }


def _rests(result: LimitCycles, fine: float, small: str) -> Block:
    columns = [
        doc.column("load", "Load", load_unit(result.design), format="short:4"),
        doc.column("step", "Step", small, format="sig:3"),
        doc.column("end", "Ends"),
        doc.column("size", "Swing, peak", small, format="sig:3", better=-1),
        doc.column("hz", "at", "Hz", format="sig:3"),
    ]
    rows = [_rest_row(one, fine) for one in result.rests]
    note = "The drive as it is: dry friction, play, quantisation and limits at work."
    return doc.table("What steps end in", columns, rows, note)


def _rest_row(one: Settling, fine: float) -> Row:
    return {
        "load": one.load_Nm,
        "step": fine * one.amplitude_rad,
        "end": one.rest.verdict + (", a limit acting" if one.rest.limited else ""),
        "size": fine * one.swing_rad if one.hunting else None,
        "hz": one.rest.frequency_hz,
        "_status": "warn" if one.hunting else None,
    }
