"""Designs, loops, margins and runs as small HTML tables: what a notebook shows for them."""

from collections.abc import Iterable
from html import escape
from math import isinf, nan
from typing import Any

from actuator_lti.design.model import Design
from actuator_lti.loops.result import Loops
from actuator_lti.margins.results import StabilityMargins


def html_table(head: str, columns: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table with a caption; every text is escaped.

    >>> html_table("a < b", [], [["1"]])
    '<table><caption>a &lt; b</caption><thead><tr></tr></thead><tbody><tr><td>1</td></tr></tbody></table>'
    """
    top = "".join(f"<th>{escape(word)}</th>" for word in columns)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    caption = f"<caption>{escape(head)}</caption>"
    return f"<table>{caption}<thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def design_html(design: Design) -> str:
    """Every value of a design as it was written, with source, grade and tolerance."""
    rows = []
    for known in design.parameters.values():
        tolerance = "" if known.tolerance is None else known.tolerance.text
        rows.append((known.path, known.symbol, known.text, tolerance, known.grade or "", known.source))
    title = f"{design.name}: {design.title}" if design.title else design.name
    return html_table(title, ("key", "symbol", "value", "tolerance", "grade", "source"), rows)


def loops_html(loops: Loops) -> str:
    """The loops that there are: where each is cut, its unit and its period."""
    rows = []
    for name, loop in loops.present.items():
        every = "continuous" if loop.period_s is None else f"{1e3 * loop.period_s:g} ms"
        rows.append((name, loop.break_point, loop.unit_in, every))
    load = f"load {loops.load_Nm:g} {loops.design.load_unit}"
    head = f"{loops.design.name}: {loops.form}, {loops.operating_point}, {load}"
    return html_table(head, ("loop", "cut at", "unit", "period"), rows)


def run_html(run: Any) -> str:
    """What came of a run (`nonlinear.Trajectory`): how far it went, which limits acted, how it ended."""
    linear = run.axis == "linear"
    factor, angle, speed = (1e3, "mm", "m/s") if linear else (57.29577951308232, "deg", "rad/s")
    rows = [
        ("rows", f"{run.time_s.size} of {1e3 * run.row_period_s:g} ms"),
        ("output, from", f"{min(factor * run.output_angle_rad, default=nan):.5g} {angle}"),
        ("output, to", f"{max(factor * run.output_angle_rad, default=nan):.5g} {angle}"),
        ("motor speed, up to", f"{max(abs(run.motor_speed_rad_s), default=nan):.5g} {speed}"),
        ("current, up to", f"{max(abs(run.current_A), default=nan):.5g} A"),
        ("at rest", f"{100.0 * run.stick_fraction:.3g} % of the ticks"),
        *(
            (f"{name} limit", f"{100.0 * use.fraction:.3g} % of the ticks, first at {use.first_time_s:.4g} s")
            for name, use in run.limits.items()
            if use.active
        ),
        ("stick, slip, reversal", f"{run.events} events"),
        ("status", run.status if not run.advice else f"{run.status}: {run.advice}"),
    ]
    return html_table(f"{run.design_name}: {run.time_s.size} rows", ("figure", "value"), rows)


def margins_html(margins: StabilityMargins) -> str:
    """The figures to quote, and how they are known."""
    result = [
        ("gain margin", _figure(margins.gain_margin_db, 1.0, "dB")),
        ("phase margin", _figure(margins.phase_margin_deg, 1.0, "deg")),
        ("delay margin", _figure(margins.delay_margin_s, 1e3, "ms")),
        ("modulus margin", _figure(margins.modulus_margin)),
        ("peak of S", _figure(margins.sensitivity_peak_db, 1.0, "dB")),
        ("evidence", margins.evidence),
        *(("note", note) for note in margins.notes),
    ]
    return html_table(f"closed loop: {margins.verdict}", ("figure", "value"), result)


def _figure(value: float | None, factor: float = 1.0, unit: str = "") -> str:
    if value is None:
        return "not known"
    return "none" if isinf(value) else f"{factor * value:.4g} {unit}".rstrip()
