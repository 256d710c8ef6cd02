"""Designs, loops and margins as small HTML tables: what a notebook shows for them."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from math import isinf
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from actuator_lti.loops.result import Loops
    from actuator_lti.margins.results import StabilityMargins


def html_table(head: str, columns: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table with a caption; every text is escaped.

    Examples
    --------
    >>> html_table("a < b", [], [["1"]])
    '<table><caption>a &lt; b</caption><thead><tr></tr></thead><tbody><tr><td>1</td></tr></tbody></table>'
    """
    top = "".join(f"<th>{escape(word)}</th>" for word in columns)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    caption = f"<caption>{escape(head)}</caption>"
    return f"<table>{caption}<thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def design_html(design: Design) -> str:
    """Every value of a design as it was written, with source, grade and tolerance."""
    rows = [
        (
            known.path,
            known.symbol,
            known.text,
            "" if known.tolerance is None else known.tolerance.text,
            known.grade or "",
            known.source,
        )
        for known in design.parameters.values()
    ]
    title = f"{design.name}: {design.title}" if design.title else design.name
    return html_table(title, ("key", "symbol", "value", "tolerance", "grade", "source"), rows)


def loops_html(loops: Loops) -> str:
    """The loops that there are: where each is cut, its unit and its period."""
    rows = [
        (
            name,
            loop.break_point,
            loop.unit_in,
            "continuous" if loop.period_s is None else f"{1e3 * loop.period_s:g} ms",
        )
        for name, loop in loops.present.items()
    ]
    head = f"{loops.design.name}: {loops.form}, {loops.operating_point}, load {loops.load_Nm:g}"
    return html_table(head, ("loop", "cut at", "unit", "period"), rows)


def margins_html(margins: StabilityMargins) -> str:
    """The figures to quote, and how they are known."""
    found = [
        ("gain margin", _figure(margins.gain_margin_db, 1.0, "dB")),
        ("phase margin", _figure(margins.phase_margin_deg, 1.0, "deg")),
        ("delay margin", _figure(margins.delay_margin_s, 1e3, "ms")),
        ("modulus margin", _figure(margins.modulus_margin, 1.0, "")),
        ("peak of S", _figure(margins.sensitivity_peak_db, 1.0, "dB")),
        ("evidence", margins.evidence),
        *(("note", note) for note in margins.notes),
    ]
    return html_table(f"closed loop: {margins.verdict}", ("figure", "value"), found)


def _figure(value: float | None, factor: float, unit: str) -> str:
    if value is None:
        return "not known"
    return "none" if isinf(value) else f"{factor * value:.4g} {unit}".rstrip()
