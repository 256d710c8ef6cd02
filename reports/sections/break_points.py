"""The loop seen at every break point: outer loops open, and all other loops closed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analyses.loop_figures import LoopFigures
from analyses.loop_survey import BreakPoint
from reports import document as doc
from reports.sections.margins import MARGIN_COLUMNS, finite, margin_row, times, worst_status
from reports.sections.names import POINTS

COLUMNS = [
    doc.column("point", "Cut at"),
    doc.column("others", "Other loops"),
    *(c for c in MARGIN_COLUMNS if c["key"] not in ("loop", "delay_margin_samples", "disk_margin")),
]
EXACT_COLUMNS = [
    doc.column("point", "Cut at"),
    doc.column("gain_upper", "Gain may grow by", "×", format="sig:4"),
    doc.column("gain_lower", "and fall to", "×", format="sig:3"),
    doc.column("delay_ms", "Delay may grow by", "ms", format="sig:3"),
]


def section(points: Mapping[str, BreakPoint], stages: Mapping[str, LoopFigures]) -> dict[str, Any]:
    """Make the section; ``stages`` are the loops with the outer ones open."""
    rows: list[dict[str, Any]] = []
    reasons: list[str] = []
    for name, point in points.items():
        own = [found for found in stages.values() if found.loop.break_point == name]
        rows += [_row(name, "outer ones open", found) for found in own]
        rows.append(_row(name, "all closed", point.figures))
        reasons += [f"{POINTS.get(name, name)}: {point.reason}."] if point.reason else []
    note = "The outermost loop has no other loop outside it, so its two lines agree."
    blocks = [doc.table("Break-point matrix", COLUMNS, rows, note)]
    blocks += [doc.text(reason) for reason in reasons]
    exact = [_exact_row(name, point) for name, point in points.items() if point.exact is not None]
    if exact:
        words = (
            "Where a fast loop is cut inside slower ones, the loop is periodically time-varying; the lines "
            "above are those of its fundamental. The true borders of stability, from the eigenvalues over "
            "one whole period, are these."
        )
        blocks += [doc.text(words), doc.table("Exact borders of periodic loops", EXACT_COLUMNS, exact)]
    intro = (
        "A gain error or a delay sits at one place in the finished drive, with every other loop running. "
        "The matrix shows what the drive tolerates at each place."
    )
    status = worst_status([point.stable for point in points.values()])
    return doc.section("break-points", "Break-point matrix", blocks, intro=intro, status=status)


def _row(name: str, others: str, found: LoopFigures | None) -> dict[str, Any]:
    if found is None:
        return {"point": POINTS.get(name, name), "others": others, "stable": "see below"}
    return {"point": POINTS.get(name, name), "others": others, **margin_row(found)}


def _exact_row(name: str, point: BreakPoint) -> dict[str, Any]:
    exact = point.exact
    assert exact is not None
    return {
        "point": POINTS.get(name, name),
        "gain_upper": finite(exact.gain_upper),
        "gain_lower": finite(exact.gain_lower) or None,
        "delay_ms": times(exact.delay_s, 1e3),
    }
