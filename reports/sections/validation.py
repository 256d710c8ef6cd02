"""The verdict of the nonlinear simulator on every linear prediction, and all sections of a validation."""

from __future__ import annotations

from collections.abc import Sequence

from analyses.validation.ledger import Entry
from analyses.validation.result import Validation
from reports import document as doc
from reports.document_schema import Block, Row, Section, Status, VerdictItem
from reports.findings import Finding
from reports.sections.conditional import findings_of
from reports.sections.names import LOOPS, POINTS, QUANTITIES

MORE = {
    "gain_margin_up": "gain margin, upwards",
    "gain_margin_down": "gain margin, downwards",
    "computing_delay_margin": "computing delay margin",
    "complementary_peak": "peak of T",
    "resonance": "resonance frequency",
    "stability": "stability",
    "steady_current": "current at a constant speed",
    "breakaway_torque": "breakaway torque",
    "steady_voltage": "drive signal at a constant speed",
    "response_open": "response of the open loop",
    "response_closed": "response of the closed loop",
    "response_command": "response to the command",
}
STATUS: dict[bool | None, Status] = {True: "pass", False: "fail", None: "info"}
WORD = {True: "agrees", False: "DISAGREES", None: "not judged"}


def section(validation: Validation, *, timing: bool = True) -> list[Section]:
    """Make all sections of a validation, verdicts first; without ``timing`` the same input gives the same."""
    from reports.sections import conditional, confirmation, counts, sweep

    sections = [
        summary(validation, timing=timing),
        *sweep.sections(validation),
        *confirmation.sections(validation),
    ]
    if validation.conditional is not None:
        sections.append(conditional.section(validation.conditional, validation.design.axis))
    if validation.counts:
        sections.append(counts.section(validation.counts, validation.design.axis))
    return [*sections, *_others(validation)]


def _others(validation: Validation) -> list[Section]:
    """Make the sections of large signals, friction and specification, as far as they were asked for."""
    from reports.sections import friction_effects, large_signal, specification

    made: list[Section] = []
    if validation.large_signals is not None:
        made.append(large_signal.section(validation.large_signals))
    if validation.friction is not None:
        made.append(friction_effects.section(validation.friction))
    if validation.specification is not None:
        made.append(specification.section(validation.specification))
    return made


def summary(validation: Validation, *, timing: bool = True) -> Section:
    """Make the section of verdicts with the ledger."""
    blocks: list[Block] = [doc.verdicts(verdict_items(validation), what="checks")]
    failed = [row for row in validation.ledger if row.passed is False]
    if failed:
        blocks.append(ledger_table(failed, "Predictions that the simulation contradicts"))
    for name, rows in by_loop(validation.ledger).items():
        blocks.append(
            doc.details(f"{loop_name(name)}: every prediction", [ledger_table(rows, loop_name(name))])
        )
    if validation.notes:
        blocks += [doc.remark(note) for note in validation.notes]
    if timing:
        blocks.append(doc.details("Where the time went", [_times(validation)]))
    intro = (
        "Every linear prediction is compared with the nonlinear simulation. Small signals are measured at "
        "constant speed, where dry friction is a constant torque. What cannot hold from rest is shown with "
        "the "
        "reason."
    )
    status: Status = "pass" if validation.passed else "fail"
    return doc.section(
        "validation", "Linear predictions against simulation", blocks, result=result(validation), intro=intro,
        status=status, findings=findings(validation),
    )  # fmt: skip


def result(validation: Validation) -> str:
    """Say how many predictions agree with the simulation."""
    judged = [row for row in validation.ledger if row.passed is not None]
    first = (
        f"{validation.instability[0].upper()}{validation.instability[1:]}. " if validation.instability else ""
    )
    if not judged:
        return f"{first}Nothing judged: no linear prediction could be compared with the simulation."
    agree, shown = sum(row.passed is True for row in judged), len(validation.ledger) - len(judged)
    rest = f" {shown} more are shown, but not judged." if shown else ""
    return f"{first}{agree} of {len(judged)} linear predictions agree with the simulation.{rest}"


def findings(validation: Validation) -> list[Finding]:
    """Name what has to be watched, the gravest first."""
    findings = [
        Finding(severity="fail", text=f"{loop_name(name)}: not stable.", where="validation")
        for name in validation.unstable
    ]
    findings += [
        Finding(severity="warn", text=f"{loop_name(name)}: stability not known.", where="validation")
        for name in validation.undecided
    ]
    findings += [
        Finding(
            severity="fail",
            text=f"{loop_name(row.loop)}: {quantity_name(row)} is not confirmed by simulation.",
            where="validation",
        )
        for row in validation.failed
    ]
    return findings + _large(validation) + _unknown(validation) + _left_out(validation)


def _large(validation: Validation) -> list[Finding]:
    """A step within full deflection that does not settle."""
    conditional = validation.conditional
    return [] if conditional is None else findings_of(conditional, validation.design.axis)


def _unknown(validation: Validation) -> list[Finding]:
    """What could not be judged for lack of time or of measured points."""
    findings = [
        Finding(severity="warn", text=f"{loop_name(name)} was not judged: {loop.reason}.", where="validation")
        for name, loop in validation.loops.items()
        if loop.figures.stable and loop.measured is None
    ]
    cut = [note for note in validation.notes if ": cut " in note and not note.endswith("used up")]
    return findings + [
        Finding(severity="warn", text=f"Not judged: {note}.", where="validation") for note in cut
    ]


def _left_out(validation: Validation) -> list[Finding]:
    """What the model of this drive leaves out."""
    findings = []
    if validation.design.coupling is None:
        text = "A rigid drive train is assumed: without a coupling no figure holds its resonance or play."
        findings.append(Finding(severity="info", text=text, where="validation"))
    return findings


def verdict_items(validation: Validation) -> list[VerdictItem]:
    """One verdict a loop or break point, one for the frequency responses, one for large commands."""
    items = []
    if not validation.judged:
        reasons = dict.fromkeys(row.reason for row in validation.ledger if row.reason)
        why = "; ".join([*reasons, *validation.notes][:3]) or "the drive has no loop"
        label = "Linear predictions that could be judged"
        items.append(_verdict("judged", label, 0, 1, ">=", "", False, f"nothing judged: {why}"))
    for name in validation.unstable + validation.undecided:
        verdict, known = validation.loops[name].figures.margins.verdict, name in validation.unstable
        label, why = f"{loop_name(name)}: stable", f"predicted: {verdict}"
        items.append(_verdict(f"stable-{name}", label, 0, 1, ">=", "", False if known else None, why))
    for name, rows in by_loop(validation.ledger).items():
        judged = [row for row in rows if row.passed is not None]
        held = sum(row.passed is True for row in judged)
        worst = [f"{quantity_name(row)}: {row.reason or 'off'}" for row in judged if row.passed is False]
        items.append(
            _verdict(
                f"predictions-{name}",
                f"{loop_name(name)}: linear predictions that agree with simulation",
                held,
                len(judged),
                ">=",
                "",
                held == len(judged) if judged else None,
                "; ".join(worst) or _agreement(held, len(rows) - len(judged)),
            )
        )
    items += _response_items(validation)
    conditional = validation.conditional
    if conditional is not None:
        full = _size(conditional.full_deflection_rad, validation.design.axis)
        reached = conditional.threshold_rad if conditional.diverges else conditional.full_deflection_rad
        reason = (
            "larger steps diverge, although every linear margin says stable" if conditional.hidden else ""
        )
        items.append(
            _verdict(
                "large-commands",
                "Largest step that settles",
                _size(reached or 0.0, validation.design.axis),
                full,
                ">=",
                "mm" if validation.design.axis == "linear" else "deg",
                not conditional.diverges,
                reason,
            )
        )
    return items


def _agreement(held: int, shown: int) -> str:
    """Say that all agree, and how many are shown beside them."""
    return f"{held} of {held} agree" + (f"; {shown} shown, not judged" if shown else "")


def _response_items(validation: Validation) -> list[VerdictItem]:
    """Agreement of measured and assembled responses up to a third of Nyquist."""
    from reports.sections.sweep import allowed_below_third, has_points, worst_below_third

    items = []
    for name, loop in validation.loops.items():
        if not loop.figures.stable:
            continue
        if not has_points(loop):
            label = f"{loop_name(name)}: difference between model and simulation"
            reason = f"not judged: {loop.reason or 'no frequency could be measured'}"
            items.append(_verdict(f"injection-{name}", label, None, 0.0, "<=", "dB", None, reason))
            continue
        values, limits = worst_below_third(loop), allowed_below_third(loop)
        for kind, value, limit, unit in zip(("gain", "phase"), values, limits, ("dB", "deg"), strict=True):
            label = f"{loop_name(name)}: largest {kind} difference between model and simulation"
            passed = value <= limit
            items.append(_verdict(f"injection-{name}-{kind}", label, value, limit, "<=", unit, passed, ""))
    return items


def _verdict(
    id: str,
    label: str,
    value: float | None,
    limit: float,
    comparison: str,
    unit: str,
    passed: bool | None,
    reason: str,
) -> VerdictItem:
    """Make one verdict; the distance is positive on the good side."""
    distance = None
    if value is not None:
        distance = value - limit if comparison == ">=" else limit - value
    return doc.verdict(
        id, label, value=value, limit=limit, unit=unit, distance=distance, passed=passed, reason=reason,
        comparison=comparison,
    )  # fmt: skip


def by_loop(rows: Sequence[Entry]) -> dict[str, list[Entry]]:
    """Group entries by loop or break point, in order."""
    by_loop: dict[str, list[Entry]] = {}
    for row in rows:
        by_loop.setdefault(row.loop, []).append(row)
    return by_loop


def ledger_table(rows: Sequence[Entry], caption: str) -> Block:
    """Lay entries out as a table."""
    columns = [
        doc.column("quantity", "Prediction"),
        doc.column("condition", "Condition"),
        doc.column("predicted", "Linear", format="sig:6"),
        doc.column("measured", "Simulated", format="sig:6"),
        doc.column("unit", "Unit"),
        doc.column("difference", "Difference", format="sig:2"),
        doc.column("tolerance", "Allowed", format="sig:2"),
        doc.column("verdict", "Verdict"),
        doc.column("reason", "Reason"),
    ]
    return doc.table(caption, columns, [row_of(row) for row in rows])


NOISE = 1e-10  # of the value: a smaller difference changes with the order in which sums are taken


def row_of(row: Entry) -> Row:
    """One entry as a row; seconds as ms; without the digits that are noise of the last bit."""
    scale, unit = (1e3, "ms") if row.unit == "s" else (1.0, row.unit)
    digits = 6 if row.quantity == "resonance" else 12  # where a flat top is highest is known to 1e-7 at best
    predicted, measured = _rounded(row.predicted, scale, digits), _rounded(row.measured, scale, digits)
    difference = _rounded(row.difference, scale, 2)
    if difference is not None and abs(difference) < NOISE * abs(predicted or 0.0):
        difference = 0.0
    if row.quantity == "resonance" and predicted is not None and measured is not None:
        difference = _rounded(measured - predicted, 1.0, 2)
    values = {
        "predicted": predicted,
        "measured": measured,
        "difference": difference,
        "tolerance": _rounded(row.tolerance, scale, 4),
    }
    return {
        "quantity": quantity_name(row),
        "condition": row.condition,
        "unit": unit,
        "verdict": WORD[row.passed],
        "reason": row.reason,
        "_status": STATUS[row.passed],
        **values,
    }


def _rounded(value: float | None, scale: float, digits: int) -> float | None:
    return None if value is None else float(f"{value * scale:.{digits}g}")


def quantity_name(row: Entry) -> str:
    """Words for a quantity."""
    return QUANTITIES.get(row.quantity) or MORE.get(row.quantity, row.quantity)


def loop_name(name: str) -> str:
    """Words for a loop or a break point."""
    return LOOPS.get(name) or f"At {POINTS.get(name, name)}, all loops closed"


def _size(value_rad: float, axis: str) -> float:
    """Output angle in deg, or way in mm."""
    return value_rad * (1e3 if axis == "linear" else 57.29577951308232)


def _times(validation: Validation) -> Block:
    """Where the time went."""
    columns = [doc.column("part", "Part"), doc.column("seconds", "Time", "s", format="fix:2")]
    rows: list[Row] = [{"part": k, "seconds": v} for k, v in validation.seconds.items()]
    rows.append({"part": "together", "seconds": sum(validation.seconds.values())})
    return doc.table("Where the time went", columns, rows)
