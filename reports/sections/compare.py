"""Variants side by side: verdicts, figures with differences, what moved them, overlaid responses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from actuator_lti.asked.verdict import Verdict
from actuator_lti.files.atomic import write_text
from actuator_lti.files.tree import Tree
from analyses.comparison.variant_figures import FigureName
from analyses.comparison.variants import Compared, Comparison
from analyses.specification.requirements import RequirementVerdict
from reports import document as doc
from reports.as_json import as_json
from reports.document_schema import Block, Column, Row, Section, Status, VerdictItem
from reports.numbers import capital, significant
from reports.sections import compare_best, compare_figures, compare_ledger, compare_many
from reports.sections.compare_best import number
from reports.sections.names import LOOPS
from reports.sections.requirements import item, label, limit_words
from reports.terminal import Brief

GROUPS = {**LOOPS, "drive": "Drive", "large": "Large signals"}
COLUMNS = 4  # variants beside the base in one table: what reads on one screen
_MOST_MOVERS = 3
_SEEN = 5e-5  # relative; a smaller difference changes no digit that is shown


def section(comparison: Comparison) -> list[Section]:
    """Make all sections of a comparison; of very many designs those at the ends are shown."""
    shown = compare_many.choice(comparison)
    best = compare_best.section(shown)
    best["intro"] = f"{best['intro']} {compare_many.shown_words(shown)}".strip()
    made = [best, verdicts(shown), figures(shown), differences(shown)]
    return [*made, *compare_ledger.sections(shown), *compare_figures.sections(shown)]


def text(comparison: Comparison | str) -> str | None:
    """The example of a study file."""
    return comparison if isinstance(comparison, str) else None


def brief(comparison: Comparison) -> Brief:
    """Which designs meet their requirements."""
    shown = compare_many.choice(comparison)
    kept = ("design", "met", "missed", "unproven")
    block = doc.with_columns(compare_best.designs(shown, note=""), kept)
    left_out = len(comparison.all) - len(shown.all)
    notes = [f"{left_out} more designs are in {compare_many.TABLE}"] if left_out else []
    return Brief(result(comparison), [block], notes)


def data(comparison: Comparison) -> Tree:
    """The result by its names."""
    kept = ("study", "names", "base", "variants", "sensitivities", "refused", "verdict")
    return {name: as_json(getattr(comparison, name)) for name in kept}


def write(comparison: Comparison, folder: Path | None) -> list[str]:
    """Write every figure of every design as a table."""
    if folder is None:
        return []
    write_text(folder / compare_many.TABLE, compare_many.table_text(comparison))
    return [str(folder / compare_many.TABLE)]


def result(comparison: Comparison) -> str:
    """Count the requirements of all designs, and name the first that is not met, or not proven."""
    everything = comparison.everything
    said = f"{comparison.tally.words('requirements')}, over {len(everything.all)} designs."
    for word in (Verdict.NOT_MET, Verdict.NOT_PROVEN):
        of = [(one, v) for one in everything.all for v in one.verdicts if v.verdict == word and not v.waiver]
        more = f", and {len(of) - 1} more" if len(of) > 1 else ""
        said += f" {word.capitalize()}: {of[0][0].variant.name}, {label(of[0][1])}{more}." if of else ""
    refused = [variant.name for variant in comparison.refused]
    more = f", and {len(refused) - 1} more" if len(refused) > 1 else ""
    said += f" No design: {refused[0]}{more}." if refused else ""
    return said + " A prediction is not confirmed by the simulator." * comparison.unconfirmed


def verdicts(comparison: Comparison) -> Section:
    """Verdicts of every design: a row a requirement, a column a design."""
    wanted = comparison.base.verdicts
    blocks: list[Block] = compare_many.worst(comparison)
    if wanted:
        note = "In brackets the difference from the base, in the unit of the requirement."
        for k, designs in enumerate(batches(comparison)):
            first = doc.column("what", "Requirement"), doc.column("limit", "Limit")
            columns = [*first, *design_columns(designs)]
            rows = [_verdict_row(verdict, designs) for verdict in wanted]
            title = "Requirements of every design" + ("" if k == 0 else f", part {k + 1}")
            blocks.append(doc.table(title, columns, rows, note if k == 0 else ""))
    blocks += [
        doc.details(f"Verdicts of {one.variant.name}", [doc.verdicts([_named(one, v) for v in one.verdicts])])
        for one in comparison.all
        if one.verdicts
    ]
    for variant in comparison.refused[: compare_many.MANY]:
        blocks.append(doc.text(f"{variant.name}: no design. {variant.error}"))
    if len(comparison.refused) > compare_many.MANY:
        blocks.append(doc.text(f"{len(comparison.refused) - compare_many.MANY} more have no design."))
    status: Status = "fail" if comparison.refused else comparison.tally.role
    words = result(comparison)
    return doc.section("verdicts", "Requirements side by side", blocks, result=words, status=status)


def batches(comparison: Comparison) -> list[list[Compared]]:
    """Divide the designs into tables that fit a page, each with the base first."""
    others = [one for one in comparison.all if one is not comparison.base]
    stretches = [others[k : k + COLUMNS] for k in range(0, len(others), COLUMNS)] or [[]]
    return [[comparison.base, *stretch] for stretch in stretches]


def design_columns(designs: Sequence[Compared]) -> list[Column]:
    """Make a column a design."""
    return [doc.column(f"d{k}", one.variant.name, align="right") for k, one in enumerate(designs)]


def _named(one: Compared, verdict: RequirementVerdict) -> VerdictItem:
    made = item(verdict)
    return {**made, "id": f"{one.variant.slug}/{made['id']}"}


def _verdict_row(wanted: RequirementVerdict, designs: Sequence[Compared]) -> Row:
    row: Row = {"what": label(wanted), "limit": limit_words(wanted.requirement)}
    for k, one in enumerate(designs):
        verdict = next((v for v in one.verdicts if v.id == wanted.id), None)
        if verdict is None or verdict.value is None:
            row[f"d{k}"] = {"text": "none", "status": verdict.role if verdict else "info"}
            continue
        words = number(verdict.value) or ""
        change = 0.0 if wanted.value is None else verdict.value - wanted.value
        if abs(change) > _SEEN * abs(verdict.value):
            words += f" ({_signed(change)})"
        row[f"d{k}"] = {"text": words, "status": verdict.role}
    return row


def figures(comparison: Comparison) -> Section:
    """Every figure of every design, a table a group; best and worst marked."""
    blocks = []
    for group, title in GROUPS.items():
        names = [name for name in comparison.names if name.group == group]
        for k, designs in enumerate(batches(comparison) if names else []):
            heading = title if k == 0 else f"{title}, part {k + 1}"
            blocks.append(_group_table(heading, names, comparison, designs))
    variants = comparison.everything.variants
    moved = sum(bool(one.differences) for one in variants)
    result = f"{moved} of {len(variants)} variants change a figure of the base."
    intro = "In brackets the difference from the base. ▲ best and ▽ worst of all designs."
    return doc.section("figures", "Figures side by side", blocks, result=result, intro=intro)


def _group_table(
    title: str, names: Sequence[FigureName], comparison: Comparison, designs: Sequence[Compared]
) -> Block:
    columns = [doc.column("figure", "Figure"), doc.column("unit", "Unit"), *design_columns(designs)]
    rows = []
    for name in names:
        unit = "ms" if name.unit == "s" else name.unit.replace("^2", "²")
        row: Row = {"figure": capital(name.label), "unit": unit}
        rows.append(row | {f"d{k}": _cell(one, name, comparison) for k, one in enumerate(designs)})
    return doc.table(title, columns, rows)


def _cell(one: Compared, name: FigureName, comparison: Comparison) -> str | None:
    value = one.figures.get(name.key)
    if value is None:
        return None
    scale = 1e3 if name.unit == "s" else 1.0
    words = number(scale * value) or ""
    if abs(one.differences.get(name.key, 0.0)) > _SEEN * abs(value):
        words += f" ({_signed(scale * one.differences[name.key])})"
    ends = comparison.ends(name)
    if ends is not None and value in ends:
        words += " ▲" if value == ends[0] else " ▽"
    return words


def differences(comparison: Comparison) -> Section:
    """What changed in each variant, and which key moved which figure."""
    blocks: list[Block] = []
    for one in comparison.variants:
        if not one.changed and not one.differences:
            blocks.append(doc.text(f"{one.variant.name}: equal to the base."))
            continue
        keys = "; ".join(f"{c.path}: {c.base} → {c.text}" for c in one.changed)
        blocks.append(doc.details(f"{one.variant.name}: {keys}"[:400], [_moved_table(one, comparison)]))
    intro = (
        "Each changed key is applied alone to the base, over the exact sampled loops. What the keys do not "
        "explain is their interaction. Large-signal figures are not taken apart."
    )
    variants = comparison.everything.variants
    changed = sum(bool(one.changed) for one in variants)
    result = f"{changed} of {len(variants)} variants change a key of the base."
    return doc.section("differences", "Cause of each change", blocks, result=result, intro=intro)


def _moved_table(one: Compared, comparison: Comparison) -> Block:
    columns = [
        doc.of(lambda name: f"{GROUPS[name.group]}: {name.label}", "figure", "Figure"),
        doc.of("unit", "unit", "Unit"),
        doc.of(lambda name: comparison.base.figures[name.key], "base", "Base", format="sig:4"),
        doc.of(lambda name: one.figures[name.key], "value", "Variant", format="sig:4"),
        doc.of(lambda name: one.differences[name.key], "difference", "Difference", format="sig:3"),
        doc.of(lambda name: _movers(one, name), "moved", "Cause"),
        doc.of(lambda name: _interaction(one, name), "rest", "Interaction", format="sig:2"),
    ]
    names = [name for name in comparison.names if name.key in one.differences]
    return doc.listing(f"{one.variant.name} against the base", names, columns)


def _movers(one: Compared, name: FigureName) -> str:
    parts = one.moved_by.get(name.key, ())[:_MOST_MOVERS]
    return ", ".join(f"{part.path} {_signed(part.amount)}" for part in parts)


def _interaction(one: Compared, name: FigureName) -> float | None:
    parts, total = one.moved_by.get(name.key, ()), one.differences[name.key]
    rest = total - sum(part.amount for part in parts)
    return rest if parts and abs(rest) > 1e-3 * abs(total) else None


def _signed(value: float) -> str:
    if not math.isfinite(value):
        return "unlimited"
    return ("+" if value > 0 else "") + significant(value, 3)
