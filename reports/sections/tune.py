"""A tuned design: gains in SI and in the controller's objects, what binds, trade-off, nonlinear check."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from actuator_lti.atomic import write_text
from actuator_lti.design import write_design
from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Block, Section, VerdictItem

if TYPE_CHECKING:
    from analyses.tuning import BindingRequirement, TuningResult

GAIN_COLUMNS = [
    doc.column("path", "Gain"),
    doc.column("unit", "Unit"),
    doc.column("before", "Before", format="sig:4"),
    doc.column("rule", "By rule", format="sig:4"),
    doc.column("tuned", "Optimised", format="sig:5"),
    doc.column("rounded", "Tuned", format="sig:5"),
    doc.column("object", "Object"),
    doc.column("steps", "Written", align="right"),
    doc.column("object_unit", "in"),
]
REQUIREMENT_COLUMNS = [
    doc.column("label", "Requirement"),
    doc.column("value", "Worst corner", format="sig:4"),
    doc.column("limit", "Limit", format="sig:4"),
    doc.column("distance", "Distance", format="sig:3"),
    doc.column("unit", "Unit"),
    doc.column("binds", "Binds", format="yesno"),
    doc.column("corner", "At"),
]
CONFIRMED_COLUMNS = [
    doc.column("label", "Requirement"),
    doc.column("value", "Certified", format="sig:4"),
    doc.column("limit", "Limit", format="sig:4"),
    doc.column("unit", "Unit"),
    doc.column("met", "Met", format="yesno"),
]
CHECK_COLUMNS = [
    doc.column("corner", "Design"),
    doc.column("amplitude", "Step", "deg", format="sig:3"),
    doc.column("rise", "Rise", "ms", format="sig:3", better=-1),
    doc.column("overshoot", "Overshoot", "%", format="fix:1", better=-1),
    doc.column("settling", "Settling 2 %", "ms", format="sig:3", better=-1),
    doc.column("error", "Final error", "%", format="fix:2"),
    doc.column("limited", "Limits that act"),
]


def section(result: TuningResult) -> Section:
    """Make the section."""
    verdicts = doc.verdicts(_verdict(r) for r in result.requirements)
    blocks: list[Block] = [verdicts, gains(result), requirements(result)]
    if result.confirmed:
        blocks.append(confirmed(result))
    if result.trade_off:
        blocks.append(_curve(result))
    if result.checks:
        blocks.append(checks(result))
    blocks += [doc.remark(note) for note in result.notes]
    blocks.append(doc.details("How the start gains were found", [doc.text(step) for step in result.steps]))
    title = "Tuning" if result.feasible else "Tuning: the requirements cannot be met"
    return doc.section(
        "tuning", title, blocks, result=summary(result), status="pass" if result.feasible else "fail"
    )


def write(result: TuningResult, folder: Path | None) -> list[str]:
    """Write the tuned design into the folder."""
    if folder is None:
        return []
    write_text(folder / "tuned.toml", write_design(result.design))
    return [str(folder / "tuned.toml")]


def summary(result: TuningResult) -> str:
    """What came out, in two or three sentences."""
    over = f"the nominal design and {result.corners - 1} corners of the tolerance box"
    if result.corners == 1:
        over = "the nominal design (no value has a tolerance)"
    if not result.feasible:
        missed = [r for r in result.requirements if r.relative < 0.0]
        if not missed:
            return f"The search meets every requirement over {over}; certified margins do not confirm it."
        worst = ", ".join(f"{r.id} by {_amount(r)}" for r in missed)
        return f"No gains meet every requirement over {over}. The best compromise misses {worst}."
    words = [f"Every requirement is met over {over}."]
    if result.placed:
        words.append(f"Gains alone do not do; added: {', '.join(result.placed)}.")
    binding = [r for r in result.requirements if r.binds]
    names = ", ".join(f"{r.id} ({_amount(r)} left)" for r in binding)
    if result.aim == "least-change":
        if not changed(result):
            return f"{words[0]} Nothing needs to change."
        words.append(f"This is the least change that does; binding: {names}." if binding else "")
    elif binding:
        words.append(f"Nothing better is possible because of {names}.")
    else:
        words[0] = f"Every requirement is met over {over}, each with 30 % or more to spare; none binds."
    return " ".join(word for word in words if word)


def changed(result: TuningResult) -> bool:
    """Whether any value differs from what the design had."""
    return any(g.before is None or g.rounded != g.before for g in result.gains)


def _amount(r: BindingRequirement) -> str:
    if r.distance is None:
        return "an unstable loop" if r.relative < 0 else "plenty"
    return f"{abs(r.distance):.3g}{'' if r.unit == '1' else ' ' + r.unit}"


def _verdict(r: BindingRequirement) -> VerdictItem:
    return doc.verdict(
        f"tuning/{r.id}", f"{r.label}, worst corner", value=r.value, limit=r.limit, unit=r.unit,
        distance=r.distance, passed=r.relative >= 0.0,
        reason="" if r.distance is not None else _amount(r),
    )  # fmt: skip


def gains(result: TuningResult) -> Block:
    """Gains in SI and in the motion controller's objects."""
    rows = [
        {
            "path": g.path, "unit": g.unit, "before": g.before, "rule": g.by_rule, "tuned": g.tuned,
            "rounded": g.rounded, "object": g.object or None, "steps": g.steps, "object_unit": g.object_unit,
        }
        for g in result.gains
    ]  # fmt: skip
    note = (
        "Tuned: rounded to the steps of the motion controller's objects, where the drive is that controller."
    )
    return doc.table("Gains", GAIN_COLUMNS, rows, note)


def requirements(result: TuningResult) -> Block:
    """Every requirement at its worst corner."""
    rows = [
        {
            "label": r.label, "value": r.value, "limit": r.limit, "distance": r.distance,
            "unit": "" if r.unit == "1" else r.unit, "binds": r.binds, "corner": _corner(r),
            "_status": "pass" if r.relative >= 0.0 else "fail",
        }
        for r in result.requirements
    ]  # fmt: skip
    return doc.table("Requirements at their worst corner", REQUIREMENT_COLUMNS, rows)


def confirmed(result: TuningResult) -> Block:
    """The requirements by certified margins."""
    rows = [
        {
            "label": v.id, "value": v.value, "unit": "" if v.requirement.unit == "1" else v.requirement.unit,
            "limit": v.requirement.minimum if v.requirement.minimum is not None else v.requirement.maximum,
            "met": v.verdict == "met", "_status": v.role,
        }
        for v in result.confirmed
    ]  # fmt: skip
    return doc.table("Confirmed by certified margins", CONFIRMED_COLUMNS, rows)


def _corner(r: BindingRequirement) -> str:
    return "; ".join(f"{path} {value:.4g}" for path, value in r.corner.items()) or "nominal"


def _curve(result: TuningResult) -> Block:
    limits = {(r.id, r.unit): r.limit for r in result.requirements}
    wanted = [q for q in result.before.requirements if (q.id, q.unit) in limits]
    width = [q.minimum for q in wanted if q.quantity == "bandwidth" and q.loop == "position"]
    margin = [q.minimum for q in wanted if q.quantity == "phase_margin" and q.minimum is not None]
    chart = Chart(width=style.WIDE, height=350.0, title="What the position loop can trade")
    panel = chart.panel()
    x, y = [p.bandwidth_hz for p in result.trade_off], [p.phase_margin_deg for p in result.trade_off]
    panel.curve(x, y, "best smallest phase margin, worst corner", colour=style.BLUE)
    for ok, marker, colour, label in (
        (True, "o", style.GREEN, "all other requirements met"),
        (False, "x", style.RED, "another requirement fails"),
    ):
        chosen = [(a, b) for a, b, p in zip(x, y, result.trade_off, strict=True) if p.feasible is ok]
        if chosen:
            xs, ys = zip(*chosen, strict=True)
            panel.points(xs, ys, label, marker=marker, colour=colour, size=7.0)
    required: style.Style = {"colour": style.RED, "width": 1.2, "dash": 1}
    if width and width[0] is not None:
        panel.x.see([width[0]])
        panel.rule_x(width[0], label="required", **required)
    if margin:
        panel.y.see([max(margin)])
        panel.rule_y(max(margin), label="required", **required)
    panel.x.label = "bandwidth of the position loop, Hz"
    panel.y.label = "smallest phase margin of all loops, deg"
    return doc.figure(
        "trade_off", chart,
        caption="Position bandwidth against the phase margin that every loop keeps at its worst corner.",
        alt=f"Curve of {len(result.trade_off)} points, phase margin falling with bandwidth.",
    )  # fmt: skip


def checks(result: TuningResult) -> Block:
    """The nonlinear check."""
    linear = result.design.axis == "linear"
    columns = [c.copy() for c in CHECK_COLUMNS]
    for c in columns:
        c["unit"] = "mm" if linear and c["key"] == "amplitude" else c["unit"]
    rows = [
        {
            "corner": c.corner, "amplitude": c.amplitude_rad * (1e3 if linear else math.degrees(1.0)),
            "rise": None if c.rise_time_s is None else 1e3 * c.rise_time_s, "overshoot": c.overshoot_percent,
            "settling": None if c.settling_time_s is None else 1e3 * c.settling_time_s,
            "error": c.final_error_percent, "limited": c.limited or "none",
            "_status": "pass" if c.settling_time_s is not None else "warn",
        }
        for c in result.checks
    ]  # fmt: skip
    note = "Steps from rest in the nonlinear model, dry friction and every limit on. A dash: not reached."
    return doc.table("Checked in the nonlinear model", columns, rows, note)
