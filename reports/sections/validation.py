"""The verdict of the nonlinear simulator on every prediction, and all sections of a validation."""

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from decimal import ROUND_UP, Context
from typing import Any, cast

from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.checks import CHECKS
from actuator_lti.drive.signals import LIMITERS
from analyses.motion.settling import waiver_of_rest
from analyses.validation.result import Validation
from analyses.validation.row import Row as Check
from reports import document as doc
from reports.numbers import capital, gain_margin, prose, row_unit
from reports.sections import beyond, friction_effects, in_time, large_signal, specification
from reports.sections.names import LOOPS, POINTS, QUANTITIES, loop_words
from reports.terminal import Brief

MORE = {
    "response": "response of the closed loop",
    "poles": "closed-loop poles",
    "gain_margin_up": "gain margin, upwards",
    "gain_margin_down": "gain margin, downwards",
    "bandwidth": "bandwidth (−3 dB) of the feedback loop",
    "bandwidth_90deg": "bandwidth at −90° of the feedback loop",
    "complementary_peak": "peak of T",
    "load_breakaway_moment": "breakaway torque of the load",
    "step": "small step in time, every sample",
    "inside_the_margin": "run just inside the gain margin",
    "outside_the_margin": "run just outside the gain margin",
}
for _limiter in LIMITERS.values():
    _onset = f"{_limiter.name}_onset".replace("-", "_")
    MORE[_onset] = f"command in front of the {_limiter.words}"
    MORE[f"{_onset}_integral"] = f"integral that the {_limiter.words} clamps"
PLACES = {"command": "Command to output", "load": "Load to output", "drive": "Numbers of the design"}
NOISE = 1e-9  # of the value: a smaller error changes with the order in which sums are taken
UP = Context(prec=2, rounding=ROUND_UP)


def section(validation: Validation) -> list[doc.Section]:
    of, axis = validation, validation.design.axis
    made = [summary(of), *in_time.sections(of)]
    made += beyond.from_rest(of.rest_sweep, axis) if of.rest_sweep else []
    made += [beyond.large_commands(of.conditional, axis)] if of.conditional else []
    made += [beyond.counts(of.counts, axis)] if of.counts else []
    made += [large_signal.section(of.large_signals)] if of.large_signals else []
    made += [friction_effects.section(of.friction)] if of.friction else []
    made += [specification.section(of.specification)] if of.specification else []
    return made


def brief(validation: Validation) -> Brief:
    """The verdict, why it is none where it is none, and every check by loop."""
    made = section(validation)
    every = [item for part in made for item in doc.judged(doc.walk(part))]
    items = [item for item in every if item["verdict"] != "met"]
    items = [item for item in items if not item["reason"] or item["reason"] not in validation.words]
    others = [item["label"] for item in every if "gathers" not in item]
    others += ["those of --large"] * (validation.friction is None)
    more = [f"a report counts more checks than these predictions: {'; '.join(others)}"] if others else []
    said = [f"{item['label']}: {item['verdict']}. {item['reason']}" for item in items]
    large = [part["result"] for part in made if part["id"] == "conditional"]
    tables = [_short_table(name, rows) for name, rows in by_loop(validation.rows).items()]
    blocks = [*map(doc.text, said), *tables, *map(doc.text, large)]
    return Brief(validation.words, blocks, [*validation.notes, *more])


def _short_table(name: str, rows: Sequence[Check]) -> doc.Block:
    """The rows of one place, with the motion that they are judged on: in the title where it is one."""
    shown = ["quantity", "predicted", "found", "unit", "error", "allowed", "verdict"]
    title, (condition, *others) = loop_name(name), sorted({row.condition for row in rows})
    if others:
        shown.append("condition")
    elif condition not in title:
        title = f"{title.removesuffix(', rotor locked')}, {condition}"
    return doc.with_columns(table(rows, title), shown)


def summary(validation: Validation) -> doc.Section:
    blocks: list[doc.Block] = [doc.verdicts(verdict_items(validation), what="checks")]
    if wrong := _wrong(validation.rows):
        blocks.append(table(wrong, "Predictions that are not met, or not proven"))
    for name, rows in by_loop(validation.rows).items():
        blocks.append(doc.details(f"{loop_name(name)}: every prediction", [table(rows, loop_name(name))]))
    blocks += [doc.remark(note) for note in validation.notes]
    intro = (
        "Every prediction is held against the derivative of the running simulator, taken on its compiled "
        "tick while the drive runs at constant speed (where dry friction is a constant torque and cogging "
        "averages out) or stands, then without dry friction and friction by load: its figures differ "
        "from those of sliding by that. What is large, starts from rest, or is shaken by counts is a "
        "finding of its own. An error of less than 10⁻⁹ of its value is rounding: that bound, or what is "
        "allowed where that is less, stands for it. A break point at which both show the outermost loop "
        "again is listed as that loop."
    )
    words = " ".join(f"{capital(each)}." for each in validation.sentences())
    return doc.section(
        "validation", "Predictions against simulation", blocks, result=words, intro=intro,
        status=validation.verdict.role(), findings=findings(validation),
    )  # fmt: skip


def _wrong(rows: Sequence[Check]) -> list[Check]:
    return [row for row in rows if row.verdict is not Verdict.MET]


def findings(validation: Validation) -> list[doc.Finding]:
    said: list[tuple[str, str]] = []
    if validation.rest_words:
        role = validation.rest.role(waived=waiver_of_rest(validation.design) is not None)
        said.append(("info" if role == "pass" else role, f"{capital(validation.rest_words)}."))
    said += [("fail", f"{loop_words(name)}: not stable.") for name in validation.unstable]
    for row in _wrong(validation.rows):
        contradicted = row.verdict is Verdict.NOT_MET
        says = "is contradicted by the simulation" if contradicted else f"is not proven: {row.because}"
        role = row.verdict.role(waived=validation.waived(f"{row.loop}/{row.name}"))
        said.append((role, f"{loop_name(row.loop)}: {quantity_name(row)} {says}."))
    made = [doc.Finding(severity=cast(doc.Severity, role), text=t, where="validation") for role, t in said]
    if validation.conditional is not None:
        made += beyond.findings_of(validation.conditional, validation.design.axis)
    if validation.design.coupling is None:
        text = "A rigid drive train is assumed: without a coupling no figure holds its resonance or play."
        made.append(doc.Finding(severity="info", text=text, where="validation"))
    return made


def verdict_items(validation: Validation) -> list[doc.VerdictItem]:
    """One verdict a loop, break point or path, and one for each thing that the drive must not do."""
    items = [_rows_item(validation, name, rows) for name, rows in by_loop(validation.rows).items()]
    if not items:
        items.append(_item("judged", "Predictions", None, "; ".join(validation.notes), value=0.0))
    for k, failure in enumerate(validation.failures):
        items.append(_item(f"drive-{k}", "Stable, and comes to rest", False, failure))
    open_ones = ((f"stable-{name}", f"{loop_name(name)}: stable") for name in validation.undecided)
    items += [_item(*one, None, "not known") for one in open_ones]
    if validation.rest is Verdict.NOT_PROVEN:
        waiver = waiver_of_rest(validation.design)
        items.append(_item("rest", "Comes to rest after a step", None, validation.rest_words, waiver=waiver))
    return items


def _rows_item(validation: Validation, name: str, rows: Sequence[Check]) -> doc.VerdictItem:
    tally = replace(validation, rows=tuple(rows)).tally
    words = [f"{quantity_name(row)}: {row.because or 'off'}" for row in _wrong(rows)[:3]]
    share = max(row.error / (row.allowed or 1.0) for row in rows)
    open_ones = tally.not_proven + tally.waived
    passed = False if tally.not_met else None if open_ones else True
    label = f"{loop_name(name)}: predictions met by the simulator"
    reason = "; ".join(words) or f"largest error {share:.1g} of what is allowed"
    waiver = f"{tally.waived} of {open_ones} waived" if tally.waived and not tally.not_proven else ""
    item = _item(name, label, passed, reason, value=float(tally.met), limit=float(tally.total))
    return {**item, "waiver": waiver, "gathers": cast(doc.Counts, asdict(tally))}


def _item(id: str, label: str, passed: bool | None, reason: str, **more: Any) -> doc.VerdictItem:
    side = ">=" if "limit" in more else ""
    return doc.verdict(f"{CHECKS}-{id}", label, passed=passed, reason=reason, comparison=side, **more)


def by_loop(rows: Sequence[Check]) -> dict[str, list[Check]]:
    return {name: [row for row in rows if row.loop == name] for name in dict.fromkeys(r.loop for r in rows)}


def table(rows: Sequence[Check], caption: str) -> doc.Block:
    def at_most(row: Check) -> float:
        """A bound of the error: no digits that are noise of the last bit; of one that is allowed that."""
        bound = _scaled(row)[0] * max(row.error, NOISE * abs(row.predicted or 1.0))
        allowed = _rounded(row, row.allowed, 2)
        most = allowed if row.error <= row.allowed and allowed is not None else math.inf
        return min(float(UP.create_decimal(f"{bound:.12g}")), most)

    columns = [
        doc.of(quantity_name, "quantity", "Prediction"),
        doc.of(lambda row: _rounded(row, row.predicted, 12), "predicted", "Predicted", format="sig:6"),
        doc.of(lambda row: _rounded(row, row.found, 10), "found", "Simulated", format="sig:6"),
        doc.of(lambda row: _scaled(row)[1], "unit", "Unit"),
        doc.of(at_most, "error", "Error at most", format="sig:2"),
        doc.of(lambda row: _rounded(row, row.allowed, 2), "allowed", "Allowed", format="sig:2"),
        doc.of(lambda row: str(row.verdict), "verdict", "Verdict"),
        doc.of(lambda row: prose(row.because), "because", "Where"),
        doc.of(lambda row: prose(row.condition), "condition", "Condition"),
    ]
    return doc.listing(
        caption, rows, columns, status=lambda row: row.verdict.role(),
        more=lambda row: {"_scale": _scaled(row)[0], "_unit": row.unit},  # back to what a night compares
    )  # fmt: skip


def _scaled(row: Check) -> tuple[float, str]:
    return row_unit(row.unit, [row.predicted, row.found])


def _rounded(row: Check, value: float | None, digits: int) -> float | None:
    scale, _ = _scaled(row)
    return None if value is None else float(f"{value * scale:.{digits}g}")


def quantity_name(row: Check) -> str:
    """Words for a quantity; a gain margin, which the simulator has as a ratio, in dB as elsewhere."""
    words = MORE.get(row.name) or QUANTITIES.get(row.name, row.name.replace("_", " "))
    words = words.replace("torque", "force") if row.unit == "N" else words
    words = words.replace("inertia", "mass") if row.unit == "kg" else words
    if not row.name.startswith("gain_margin") or not row.predicted:
        return words
    return f"{words}, {gain_margin(20.0 * math.log10(row.predicted), 2)} dB"


def loop_name(name: str) -> str:
    known = PLACES.get(name) or LOOPS.get(name)
    if name == "current":
        return f"{known}, rotor locked"
    return known or f"At {POINTS.get(name, name)}, all loops closed"
