"""The three linear forms side by side: what sampling and delay cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analyses.linear.loop_figures import LoopFigures
from analyses.linear.responses import curve, frequency_grid
from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Block, Row, Section
from reports.numbers import to_minus
from reports.sections.loop import nyquist_hz
from reports.sections.loop_charts import both
from reports.sections.margins import evidence_notes, margin_row, response_row
from reports.sections.names import FORMS, figure_column, loop_words

COLUMNS = [
    doc.column("loop", "Loop"),
    doc.column("form", "Form"),
    doc.column("crossover_hz", "Crossover", "Hz", format="sig:4"),
    figure_column("phase_margin", "phase_margin_deg", format="fix:2"),
    doc.column("phase_cost_deg", "against ideal", "deg", format="fix:2"),
    figure_column("gain_margin", "gain_margin_db", format="fix:2"),
    figure_column("delay_margin", "delay_margin_ms", format="sig:3"),
    figure_column("sensitivity_peak", "s_peak_db", format="fix:2"),
    figure_column("bandwidth", "minus3db_hz", format="sig:4"),
    figure_column("bandwidth_90deg", "minus90deg_hz", format="sig:4"),
]


def section(forms: Mapping[str, Mapping[str, LoopFigures]], refused: Sequence[str] = ()) -> Section:
    """Make the section from the figures by form and loop; ``refused`` says which are missing, and why."""
    rows = [
        _row(name, form, result[name], forms.get("ideal", {}).get(name))
        for name in forms["sampled"]
        for form, result in forms.items()
        if name in result
    ]
    note = (
        "Sampled: exact. Continuous: PI in s with the exact delays of computing and hold. Ideal: the same "
        "without any delay, the model of the paper. No form uses a Padé approximation."
    )
    named = {f"{FORMS[form]}, {name}": f for form, result in forms.items() for name, f in result.items()}
    reasons = evidence_notes(named)
    note += "" if reasons else " All margins are certified."
    table = doc.table("Margins and bandwidths in the three forms", COLUMNS, rows, note)
    intro = "The forms differ by sampling, hold and computing delay."
    blocks = [_overlay(forms), table, *(doc.text(f"Not found: {reason}.") for reason in refused)]
    blocks += [doc.text(reason) for reason in reasons]
    return doc.section("forms", "Sampled, continuous, ideal", blocks, result=_result(rows), intro=intro)


def _result(rows: Sequence[Mapping[str, Any]]) -> str:
    """Say which loop loses most phase margin against the ideal form."""
    costs = [row for row in rows if row["form"] == FORMS["sampled"] and row["phase_cost_deg"] is not None]
    if not costs:
        return "No phase margin is known in both the sampled and the ideal form."
    row = min(costs, key=lambda row: float(row["phase_cost_deg"]))
    change = to_minus(f"{row['phase_cost_deg']:+.1f}")
    most = ", the largest change of all loops" if len(costs) > 1 else ""
    return (
        f"Sampling and delay change the phase margin of the {row['loop'].lower()} by {change} deg{most}; "
        "its crossover moves, too."
    )


def _row(name: str, form: str, figures: LoopFigures, ideal: LoopFigures | None) -> Row:
    """Give one line, with the phase margin lost against the ideal form."""
    margins, response = margin_row(figures), response_row(figures)
    reference = margin_row(ideal)["phase_margin_deg"] if ideal else None
    own = margins["phase_margin_deg"]
    cost = None if own is None or reference is None or form == "ideal" else own - reference
    row = {**margins, **response, "loop": loop_words(name), "form": FORMS[form], "phase_cost_deg": cost}
    return row | ({"_status": "fail"} if figures.sound is False else {})


def _overlay(forms: Mapping[str, Mapping[str, LoopFigures]]) -> Block:
    """Make the overlaid open-loop Bode figures of all loops."""
    chart = Chart(width=style.WIDE, height=400.0)
    for name, sampled in forms["sampled"].items():
        grid = frequency_grid(sampled, points=130)
        curves = [
            (FORMS[form], curve(result[name].loop.plain_open, grid))
            for form, result in forms.items()
            if name in result
        ]
        top, bottom = chart.column(1.0, 1.0, title=loop_words(name))
        both(curves, nyquist_hz(sampled), top, bottom, span=120.0)
        top.rule_y(0.0, colour=style.INK)
        bottom.rule_y(-180.0, colour=style.INK)
    caption = "Open loops in the three forms, each up to its Nyquist frequency (dotted line)."
    return doc.figure("forms", chart, caption=caption, alt=f"Bode diagrams. {caption}")
