"""A tuned design: gains in SI and in the controller's objects, what binds, trade-off, nonlinear check."""

from pathlib import Path

from actuator_lti.asked.quantities import with_unit
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.model import Design
from actuator_lti.design.writing import value_as_stated, write_changed
from actuator_lti.files.atomic import write_text
from analyses.tuning.result import BindingRequirement, TuningResult
from reports import document as doc
from reports.charts import style
from reports.sections.names import command_unit
from reports.sections.requirements import item, label, table


def section(result: TuningResult) -> doc.Section:
    searched = (_verdict(one, result.before) for one in result.requirements)
    verdicts = doc.verdicts([*searched, *map(item, result.others)])
    blocks: list[doc.Block] = [
        *(verdicts, gains(result)),
        *table(result.confirmed, "Confirmed by certified margins"),
        *([_curve(result)] if result.trade_off else []),
        *([checks(result)] if result.checks else []),
        *map(doc.remark, result.notes),
        doc.details("How the start gains were found", list(map(doc.text, result.steps))),
    ]
    title = "Tuning" if result.feasible else "Tuning: the requirements cannot be met"
    return doc.section("tuning", title, blocks, result=summary(result), status=result.verdict.role())


def write(result: TuningResult, folder: Path) -> list[str]:
    if not result.feasible:
        return []
    write_text(folder / "tuned.toml", write_changed(result.before, result.design))
    return [str(folder / "tuned.toml")]


def summary(result: TuningResult) -> str:
    """What was found of what is searched for, and which of the other requirements are not met."""
    sentences = [_searched(result)]
    if result.others and all(one.verdict is Verdict.MET for one in result.others):
        sentences.append("The tuned design meets every other requirement.")
    for word in (Verdict.NOT_MET, Verdict.NOT_PROVEN):
        open_ones = (one for one in result.others if one.verdict == word and not one.passes)
        names = "; ".join(map(label, open_ones))
        sentences += [f"{word.capitalize()}, and not searched for: {names}."] if names else []
    return " ".join(sentences)


def _searched(result: TuningResult) -> str:
    over = f"the nominal design and {result.corners - 1} corners of the tolerance box"
    if result.corners == 1:
        over = "the nominal design (no value has a tolerance)"
    if not result.feasible:
        missed = ", ".join(f"{r.id} by {_amount(r)}" for r in result.requirements if r.relative < 0.0)
        if not missed:
            return f"The search meets every requirement over {over}; certified margins do not confirm it."
        return f"No gains meet every requirement over {over}. The best compromise misses {missed}."
    words = f"Every requirement {'searched for ' * bool(result.others)}is met over {over}"
    rest = f" But the drive does not come to rest {result.hunting}." if result.hunting else ""
    placed = f" Gains alone do not do; added: {', '.join(result.placed)}." if result.placed else ""
    names = ", ".join(f"{r.id} ({_amount(r)} left)" for r in result.requirements if r.binds)
    if result.aim == "least-change":
        if not changed(result):
            return f"{words}. No gain needs to change.{rest}"
        least = "the least change found" if result.spent else "the least change that does"
        return f"{words}.{placed}{f' This is {least}; binding: {names}.' if names else ''}{rest}"
    if names:
        better = "was found; binding:" if result.spent else "is possible because of"
        return f"{words}.{placed} Nothing better {better} {names}.{rest}"
    return f"{words}, each with 30 % or more to spare; none binds.{placed}{rest}"


def changed(result: TuningResult) -> bool:
    return any(g.before is None or g.rounded != g.before for g in result.gains)


def _amount(r: BindingRequirement) -> str:
    if r.distance is None:
        return "an unstable loop" if r.relative < 0 else "unbounded"
    return "nothing" if _at_limit(r) else with_unit(abs(r.distance), r.unit, ".3g")


def _at_limit(r: BindingRequirement) -> bool:
    """Whether it is met with less to spare than the digits of its limit show."""
    return 0.0 <= r.relative < 1e-4


def _verdict(r: BindingRequirement, design: Design) -> doc.VerdictItem:
    said = (f"{path} {value_as_stated(design, path, value)}" for path, value in r.corner.items())
    corner = "; ".join(said) or "nominal"
    reason = [_amount(r)] * (r.distance is None) + ["binds"] * r.binds + [f"at {corner}"]
    return doc.verdict(
        f"tuning/{r.id}", f"{r.label}, worst corner", value=r.value, limit=r.limit, unit=r.unit,
        distance=0.0 if _at_limit(r) else r.distance, passed=r.relative >= 0.0, reason="; ".join(reason),
    )  # fmt: skip


def gains(result: TuningResult) -> doc.Block:
    note = (
        "Tuned: rounded to the steps of the motion controller's objects, where the drive is that controller."
    )
    columns = [
        doc.of("path", "path", "Gain"),
        doc.of("unit", "unit", "Unit"),
        doc.of("before", "before", "Before", format="sig:4"),
        doc.of("by_rule", "rule", "By rule", format="sig:4"),
        doc.of("tuned", "tuned", "Optimised", format="sig:5"),
        doc.of("rounded", "rounded", "Tuned", format="sig:5"),
        doc.of(lambda g: g.object or None, "object", "Object"),
        doc.of("steps", "steps", "Written", align="right"),
        doc.of("object_unit", "object_unit", "in"),
    ]
    if not any(g.object for g in result.gains):  # another drive than that controller
        columns, note = columns[:-3], ""
    return doc.listing("Gains", result.gains, columns, note)


def _curve(result: TuningResult) -> doc.Block:
    limits = {(r.id, r.unit) for r in result.requirements}
    wanted = [q for q in result.before.requirements if (q.id, q.unit) in limits]
    outer = result.design.controller.outermost
    width = [q.minimum for q in wanted if q.quantity == "bandwidth" and q.loop == outer]
    margin = style.known(q.minimum for q in wanted if q.quantity == "phase_margin")
    chart = style.Chart(width=style.WIDE, height=350.0, title=f"What the {outer} loop can trade")
    panel = chart.panel(f"bandwidth of the {outer} loop, Hz", "smallest phase margin of all loops, deg")
    x, y = [p.bandwidth_hz for p in result.trade_off], [p.phase_margin_deg for p in result.trade_off]
    panel.curve(x, y, "best smallest phase margin, worst corner", colour=style.BLUE)
    for ok, marker, colour, legend in (
        (True, "o", style.GREEN, "all other requirements met"),
        (False, "x", style.RED, "another requirement fails"),
    ):
        if chosen := [(p.bandwidth_hz, p.phase_margin_deg) for p in result.trade_off if p.feasible is ok]:
            xs, ys = zip(*chosen, strict=True)
            panel.points(xs, ys, legend, marker=marker, colour=colour, size=7.0)
    required: style.Style = {"colour": style.RED, "width": 1.2, "dash": 1, "seen": True, "label": "required"}
    if width and width[0] is not None:
        panel.rule_x(width[0], **required)
    if margin:
        panel.rule_y(max(margin), **required)
    caption = (
        f"{outer.capitalize()} bandwidth against the phase margin that every loop keeps at its worst corner."
    )
    return doc.figure("trade_off", chart, caption)


def checks(result: TuningResult) -> doc.Block:
    columns = [
        doc.of("corner", "corner", "Design"),
        doc.of("amplitude_rad", "amplitude", "Step", **command_unit(result.design).column()),
        doc.of("rise_time_s", "rise", "Rise", "ms", scale=1e3, format="ms:3", better=-1),
        doc.of("overshoot_percent", "overshoot", "Overshoot", "%", format="fix:1", better=-1),
        doc.of("settling_time_s", "settling", "Settling 2 %", "ms", scale=1e3, format="ms:3", better=-1),
        doc.of("final_error_percent", "error", "Final error", "%", format="fix:2"),
        doc.of(lambda c: c.limited or "none", "limited", "Limits that act"),
    ]
    note = "Steps from rest in the nonlinear model, dry friction and every limit on. A dash: not reached."
    return doc.listing(
        "Checked in the nonlinear model", result.checks, columns, note,
        lambda c: "pass" if c.settling_time_s is not None else "warn",
    )  # fmt: skip
