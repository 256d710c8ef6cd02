"""Variants side by side: verdicts, figures with differences, what moved them, overlaid responses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from reports import document as doc
from reports.numbers import significant
from reports.sections import compare_figures, compare_ledger
from reports.sections.names import LOOPS
from reports.sections.requirements import item, label

if TYPE_CHECKING:
    from analyses.requirements import RequirementVerdict
    from analyses.variant_figures import FigureName
    from analyses.variants import Compared, Comparison

GROUPS = {**LOOPS, "drive": "Drive", "large": "Large signals"}
_MOST_MOVERS = 3
_SEEN = 5e-5  # relative; a smaller difference changes no digit that is shown


def sections(comparison: Comparison) -> list[dict[str, Any]]:
    """Make all sections of a comparison."""
    made = [verdicts(comparison), figures(comparison), differences(comparison)]
    made += compare_ledger.sections(comparison)
    made += compare_figures.sections(comparison)
    return made


def verdicts(comparison: Comparison) -> dict[str, Any]:
    """Verdicts of every design, side by side."""
    wanted = comparison.base.verdicts
    blocks: list[dict[str, Any]] = []
    if wanted:
        columns = [doc.column("design", "Design")]
        columns += [
            doc.column(f"r{k}", f"{label(v)} {_limit(v)}", align="right") for k, v in enumerate(wanted)
        ]
        rows = [_verdict_row(one, comparison) for one in comparison.all]
        note = "In brackets the difference to the base, in the unit of the requirement."
        blocks.append(doc.table("Requirements, side by side", columns, rows, note))
    blocks += [
        doc.details(f"Verdicts of {one.variant.name}", [doc.verdicts([_named(one, v) for v in one.verdicts])])
        for one in comparison.all
        if one.verdicts
    ]
    for variant in comparison.refused:
        blocks.append(doc.text(f"{variant.name}: no design. {variant.error}"))
    failed = comparison.refused or any(v.passed is False for one in comparison.all for v in one.verdicts)
    count = len(comparison.variants)
    intro = f"The base {comparison.base.variant.name} and {count} variant{'s' * (count != 1)}."
    status = "fail" if failed else "pass"
    return doc.section("verdicts", "Verdicts side by side", blocks, intro=intro, status=status)


def overview(comparison: Comparison) -> dict[str, Any]:
    """One line a design: how many requirements it meets, and which it misses."""
    columns = [doc.column("design", "Design"), doc.column("met", "Met"), doc.column("missed", "Missed")]
    rows = []
    for one in comparison.all:
        missed = [v.id for v in one.verdicts if v.passed is False]
        met = sum(v.passed is True for v in one.verdicts)
        rows.append({
            "design": one.variant.name, "met": f"{met} of {len(one.verdicts)}", "missed": ", ".join(missed),
            "_status": "fail" if missed else "pass",
        })  # fmt: skip
    return doc.table("Requirements", columns, rows)


def _named(one: Compared, verdict: RequirementVerdict) -> dict[str, Any]:
    made = item(verdict)
    return {**made, "id": f"{one.variant.slug}/{made['id']}"}


def _limit(verdict: RequirementVerdict) -> str:
    r = verdict.requirement
    parts = [f"≥ {r.minimum:g}"] if r.minimum is not None else []
    parts += [f"≤ {r.maximum:g}"] if r.maximum is not None else []
    return f"{' and '.join(parts)} {'' if r.unit == '1' else r.unit}".rstrip()


def _verdict_row(one: Compared, comparison: Comparison) -> dict[str, Any]:
    by_id = {v.id: v for v in one.verdicts}
    row: dict[str, Any] = {"design": one.variant.name}
    for k, wanted in enumerate(comparison.base.verdicts):
        verdict = by_id.get(wanted.id)
        if verdict is None or verdict.value is None:
            row[f"r{k}"] = {
                "text": "none",
                "status": "fail" if verdict and verdict.passed is False else "info",
            }
            continue
        words = _number(verdict.value)
        change = 0.0 if wanted.value is None else verdict.value - wanted.value
        if abs(change) > _SEEN * abs(verdict.value):
            words += f" ({_signed(change)})"
        row[f"r{k}"] = {"text": words, "status": "pass" if verdict.passed else "fail"}
    return row


def figures(comparison: Comparison) -> dict[str, Any]:
    """Every figure of every design, a table a group; best and worst marked."""
    blocks = []
    for group, title in GROUPS.items():
        names = [name for name in comparison.names if name.group == group]
        if names:
            blocks.append(_group_table(title, names, comparison))
    intro = "In brackets the difference to the base. ▲ best and ▽ worst of a column."
    return doc.section("figures", "Figures side by side", blocks, intro=intro)


def _group_table(title: str, names: Sequence[FigureName], comparison: Comparison) -> dict[str, Any]:
    columns = [doc.column("design", "Design")]
    columns += [doc.column(name.key, _title(name.label), name.unit, align="right") for name in names]
    rows = []
    for one in comparison.all:
        row: dict[str, Any] = {"design": one.variant.name}
        for name in names:
            row[name.key] = _cell(one, name, comparison)
        rows.append(row)
    return doc.table(title, columns, rows)


def _title(words: str) -> str:
    return words[:1].upper() + words[1:]


def _cell(one: Compared, name: FigureName, comparison: Comparison) -> str | None:
    value = one.figures.get(name.key)
    if value is None:
        return None
    words = _number(value)
    if abs(one.differences.get(name.key, 0.0)) > _SEEN * abs(value):
        words += f" ({_signed(one.differences[name.key])})"
    ends = comparison.ends(name)
    if ends is not None and value in ends:
        words += " ▲" if value == ends[0] else " ▽"
    return words


def differences(comparison: Comparison) -> dict[str, Any]:
    """What changed in each variant, and which key moved which figure."""
    blocks: list[dict[str, Any]] = []
    for one in comparison.variants:
        if not one.changed and not one.differences:
            blocks.append(doc.text(f"{one.variant.name}: differs in nothing from the base."))
            continue
        keys = "; ".join(f"{c.path}: {c.base} → {c.text}" for c in one.changed)
        blocks.append(doc.details(f"{one.variant.name}: {keys}"[:400], [_moved_table(one, comparison)]))
    intro = (
        "For each difference the changed keys one at a time, starting from the base, over the exact sampled "
        "loops; what they do not explain is their interaction. Large-signal figures are not taken apart."
    )
    return doc.section("differences", "What moved what", blocks, intro=intro)


def _moved_table(one: Compared, comparison: Comparison) -> dict[str, Any]:
    columns = [
        doc.column("figure", "Figure"),
        doc.column("unit", "Unit"),
        doc.column("base", "Base", format="sig:4"),
        doc.column("value", "Variant", format="sig:4"),
        doc.column("difference", "Difference", format="sig:3"),
        doc.column("moved", "Moved by"),
        doc.column("rest", "Together", format="sig:2"),
    ]
    rows = []
    for name in comparison.names:
        if name.key not in one.differences:
            continue
        parts = one.moved_by.get(name.key, ())
        total = one.differences[name.key]
        rest = total - sum(part.amount for part in parts)
        shown = ", ".join(f"{part.path} {_signed(part.amount)}" for part in parts[:_MOST_MOVERS])
        rows.append({
            "figure": f"{GROUPS[name.group]}: {name.label}", "unit": name.unit,
            "base": comparison.base.figures[name.key], "value": one.figures[name.key], "difference": total,
            "moved": shown, "rest": rest if parts and abs(rest) > 1e-3 * abs(total) else None,
        })  # fmt: skip
    return doc.table(f"{one.variant.name} against the base", columns, rows)


def _number(value: float) -> str:
    return significant(value, 4) if math.isfinite(value) else "unlimited"


def _signed(value: float) -> str:
    if not math.isfinite(value):
        return "unlimited"
    return ("+" if value > 0 else "") + significant(value, 3)
