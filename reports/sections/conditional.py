"""Conditional stability that a limit brings out."""

from __future__ import annotations

import math
from typing import Any

from analyses.large_signal.conditional import Conditional, Prediction
from reports import document as doc
from reports.document_schema import Block, Section, Status
from reports.findings import Finding
from reports.sections.names import POINTS, output_unit


def section(conditional: Conditional, axis: str = "rotary") -> Section:
    """Make the section: what the describing functions say, and what steps of growing size do."""
    scale, unit = output_unit(axis)
    result, *more = _words(conditional, scale, unit)
    blocks = [*map(doc.text, more), _facts(conditional, scale, unit)]
    if conditional.predictions:
        blocks.append(_table(conditional.predictions, scale, unit))
    intro = (
        "A limit reduces the effective gain. A loop with a lower gain margin can then become unstable at "
        "large commands, although every linear margin is sufficient."
    )
    status: Status = "fail" if conditional.diverges else "pass"
    findings = findings_of(conditional, axis)
    return doc.section(
        "conditional", "Large commands and conditional stability", blocks, result=result, intro=intro,
        status=status, findings=findings,
    )  # fmt: skip


def findings_of(conditional: Conditional, axis: str = "rotary") -> list[Finding]:
    """What a reader must know of large commands."""
    if not conditional.diverges:
        return []
    return [Finding(severity="fail", text=sentence(conditional, axis), where="conditional")]


def sentence(conditional: Conditional, axis: str = "rotary") -> str:
    """Say in one sentence what large commands do."""
    return _words(conditional, *output_unit(axis))[0]


def _words(conditional: Conditional, scale: float, unit: str) -> list[str]:
    """Say in some sentences what was found, the result first."""
    full = f"{conditional.full_deflection_rad * scale:.4g} {unit}"
    if not conditional.diverges:
        return [f"No step from rest up to full deflection ({full}) is made to oscillate by a limit."]
    threshold = conditional.threshold_rad or 0.0
    beyond = f"beyond {threshold * scale:.4g} {unit}" if threshold else "of any size"
    words = f"Steps {beyond} do not settle (full deflection {full})"
    words += ", although every loop is stable by its linear margins" if conditional.hidden else ""
    words += f": {_ending(conditional, scale, unit)}." if conditional.ending else "."
    made = [words]
    if conditional.oscillation_hz is not None and conditional.oscillation_rad is not None:
        size = f"{conditional.oscillation_rad * scale:.3g} {unit}"
        made.append(
            f"At the threshold the output nears a limit cycle of {size} at "
            f"{conditional.oscillation_hz:.3g} Hz."
        )
        free = [one for one in conditional.predictions if not one.antiwindup]
        if free:
            best = free[0]
            made.append(
                f"The describing function of the {best.limiter} limit predicts "
                f"{best.output_rad * scale:.3g} {unit} at {best.frequency_hz:.3g} Hz."
            )
    return made


def _ending(conditional: Conditional, scale: float, unit: str) -> str:
    """Say what the smallest step that does not settle ends in, and which limit acts."""
    swing = f"{(conditional.end_rad or 0.0) * scale:.3g} {unit}"
    sizes = {
        "diverges": "the output diverges",
        "keeps oscillating": f"the output keeps oscillating with {swing}",
        "is held by a limit": "the drive stops short of the command",
    }
    words = sizes[conditional.ending]
    if conditional.limiter:
        words += f"; the {conditional.limiter} limit acts {100 * conditional.limiter_share:.0f} % of the time"
    return words


def _facts(conditional: Conditional, scale: float, unit: str) -> Block:
    size = (conditional.threshold_rad or conditional.full_deflection_rad) * scale
    items = [doc.fact("Largest step that no limit keeps moving", size, unit, better=1)]
    for point, margins in conditional.margins.items():
        if margins.stable and margins.gain_lower > 0.0:
            label = f"Lower gain margin at {POINTS.get(point, point)}, all loops closed"
            items.append(doc.fact(label, _lower_db(margins), "dB", better=2))
    return doc.facts(items)


WINDUP = {True: "yes: safer than predicted", False: "no"}


def _lower_db(of: Any) -> float:
    return 20.0 * math.log10(of.gain_lower)


def _table(predictions: tuple[Prediction, ...], scale: float, unit: str) -> Block:
    columns = [
        doc.of("limiter", "limiter", "Limit"),
        doc.of(lambda one: POINTS.get(one.point, one.point), "point", "In front of it"),
        doc.of(_lower_db, "gain", "Lower gain margin", "dB", format="sig:4", better=2),
        doc.of(lambda one: one.amplitude / one.limit, "ratio", "Amplitude over limit", format="sig:3"),
        doc.of("frequency_hz", "hertz", "Oscillates at", "Hz", format="sig:3"),
        doc.of("output_rad", "output", "Output", unit, scale=scale, format="sig:3"),
        doc.of(lambda one: WINDUP[one.antiwindup], "antiwindup", "Anti-windup in front"),
    ]
    note = "Describing function of saturation: from this amplitude on an oscillation is sustained."
    return doc.listing("Predicted limit cycles", predictions, columns, note)
