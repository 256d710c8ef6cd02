"""The loop seen at every break point: outer loops open, and all other loops closed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analyses.linear.loop_figures import LoopFigures
from analyses.linear.loop_survey import BreakPoint
from reports import document as doc
from reports.document_schema import Row, Section
from reports.sections.margins import MARGIN_COLUMNS, evidence_notes, margin_row, worst_status
from reports.sections.names import POINTS

COLUMNS = [
    doc.column("point", "Cut at"),
    doc.column("others", "Other loops"),
    *(c for c in MARGIN_COLUMNS if c["key"] not in ("loop", "delay_margin_samples", "disk_margin")),
]
EXACT_COLUMNS = [
    doc.of(lambda pair: POINTS.get(pair[0], pair[0]), "point", "Cut at"),
    doc.of(lambda pair: pair[1].gain_upper, "gain_upper", "Gain may grow by", "×", format="sig:4"),
    doc.of(lambda pair: pair[1].gain_lower or None, "gain_lower", "and fall to", "×", format="sig:3"),
    doc.of(lambda pair: pair[1].delay_s, "delay_ms", "Delay may grow by", "ms", scale=1e3, format="sig:3"),
]


def section(points: Mapping[str, BreakPoint], stages: Mapping[str, LoopFigures]) -> Section:
    """Make the section; ``stages`` are the loops with the outer ones open."""
    rows: list[Row] = []
    reasons: list[str] = []
    for name, point in points.items():
        own = [result for result in stages.values() if result.loop.break_point == name]
        rows += [_row(name, "outer ones open", result) for result in own]
        rows.append(_row(name, "all closed", point.figures))
        reasons += [f"{POINTS.get(name, name)}: {point.reason}."] if point.reason else []
    note = "The outermost loop has no other loop outside it, so its two lines agree."
    blocks = [doc.table("Break-point matrix", COLUMNS, rows, note)]
    there = {POINTS.get(name, name): one.figures for name, one in points.items() if one.figures is not None}
    reasons += evidence_notes(there)
    blocks += [doc.text(reason) for reason in reasons]
    exact = [(name, point.exact) for name, point in points.items() if point.exact is not None]
    if exact:
        words = (
            "A fast loop cut inside slower ones is periodically time-varying; the rows above describe its "
            "fundamental. The exact stability limits follow from the eigenvalues over one period."
        )
        blocks += [doc.text(words), doc.listing("Stability limits of periodic loops", exact, EXACT_COLUMNS)]
    intro = (
        "In the finished drive a gain error or a delay occurs at one point, with every other loop closed. "
        "The matrix shows what the drive tolerates at each point."
    )
    status = worst_status([point.stable for point in points.values()])
    return doc.section(
        "break-points", "Break-point matrix", blocks, result=_result(rows), intro=intro, status=status
    )


def _result(rows: Sequence[Mapping[str, Any]]) -> str:
    """Say where the finished drive tolerates least."""
    closed = [row for row in rows if row["others"] == "all closed" and row.get("s_peak_db") is not None]
    if not closed:
        return "No margin of the finished drive is known."
    row = max(closed, key=lambda row: float(row["s_peak_db"]))
    return (
        f"With all loops closed the drive is most sensitive at the {row['point']}: peak of S "
        f"{row['s_peak_db']:.2f} dB."
    )


def _row(name: str, others: str, figures: LoopFigures | None) -> Row:
    if figures is None:
        return {"point": POINTS.get(name, name), "others": others, "stable": "see below"}
    return {"point": POINTS.get(name, name), "others": others, **margin_row(figures)}
