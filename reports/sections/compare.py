"""Variants side by side: verdicts, figures with differences, what moved them, predictions."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from actuator_lti.asked.quantities import shown_unit, unit_words
from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.files.atomic import write_text
from actuator_lti.files.reading import Tree
from analyses.comparison.found import FigureName, LargeSignal
from analyses.comparison.variants import Compared, Comparison
from analyses.specification.requirements import RequirementVerdict
from analyses.validation.row import Row as Check
from reports import document as doc
from reports.as_json import as_json
from reports.numbers import capital, row_unit, show_signed, significant
from reports.sections import compare_best, compare_figures
from reports.sections.compare_best import SEEN, number, unstable_words
from reports.sections.names import LOOPS, command_unit
from reports.sections.requirements import item, label, limit_words
from reports.sections.validation import loop_name, quantity_name
from reports.terminal import Brief

GROUPS = {**LOOPS, "drive": "Drive", "large": "Large signals"}
COLUMNS = 4  # variants beside the base in one table: what reads on one screen
_MOST_MOVERS = 3
_TERMINAL = ("gain_margin", "phase_margin", "modulus_margin", "bandwidth", "overshoot", "settling_time")
_OF_GROUP = doc.of(lambda name: f"{GROUPS[name.group]}: {name.label}", "figure", "Figure")
_MARKS = (
    "In brackets the difference from the base. ▲ best and ▽ worst of the stable designs; a loop that is not "
    "stable has no figures. Margins by their size: one downwards counts as one upwards."
)


def section(comparison: Comparison) -> list[doc.Section]:
    """Make all sections of a comparison; of very many designs those at the ends are shown."""
    shown = compare_best.choice(comparison)
    best = compare_best.section(shown)
    best["intro"] = f"{best['intro']} {compare_best.shown_words(shown)}".strip()
    made = [best, verdicts(shown), figures(shown), differences(shown)]
    return [*made, *predictions(shown), compare_figures.overlays(shown), compare_figures.tornadoes(shown)]


def brief(comparison: Comparison) -> Brief:
    shown = compare_best.choice(comparison)
    kept = ("design", "met", "missed", "unproven")
    block = doc.with_columns(compare_best.designs(shown, note=""), kept)
    wanted = {f"{loop}.{quantity}" for loop in LOOPS for quantity in _TERMINAL}
    moved = [n for n in shown.names if any(_is_other(n, one, shown.base) for one in shown.variants)]
    names = [name for loop in LOOPS for name in moved if name.group == loop and name.key in wanted]
    loops = _of_figures("Loops", names, _OF_GROUP, shown, [shown.all], _MARKS) if names else []
    left_out = len(comparison.all) - len(shown.all)
    notes = [f"{left_out} more designs are in {compare_best.TABLE}"] if left_out else []
    in_parts = [{**one, "heads": 3} for one in loops]  # figure, unit and base, before the variants
    return Brief(result(comparison), [block, *in_parts], notes)


def _is_other(name: FigureName, one: Compared, base: Compared) -> bool:
    """Whether a figure of a loop differs from the base's; also where only one of them has the loop."""
    alone = (name.key in one.figures) != (name.key in base.figures)
    return alone or name.key in one.differences or name.group in one.unstable


def data(comparison: Comparison) -> Tree:
    kept = ("study", "names", "base", "variants", "sensitivities", "refused", "verdict")
    return {name: as_json(getattr(comparison, name)) for name in kept}


def write(comparison: Comparison, folder: Path) -> list[str]:
    write_text(folder / compare_best.TABLE, compare_best.table_text(comparison))
    return [str(folder / compare_best.TABLE)]


def result(comparison: Comparison) -> str:
    """Count the requirements of all designs; name the first that is not stable, not met, or not proven."""
    everything = comparison.everything
    designs = f"{len(everything.all)} design{'s' * bool(everything.variants)}"
    said = f"{comparison.tally.words('requirements')}, over {designs}."
    unstable = [f"{one.variant.name}, {unstable_words(one)}" for one in everything.all if one.unstable]
    said += _first_of("Not stable", unstable)
    for word in (Verdict.NOT_MET, Verdict.NOT_PROVEN):
        of = [(one, v) for one in everything.all for v in one.verdicts if v.verdict == word and not v.waiver]
        said += _first_of(word.capitalize(), [f"{one.variant.name}, {label(v)}" for one, v in of])
    said += _first_of("No design", [variant.name for variant in comparison.refused])
    return said + " A prediction is not confirmed by the simulator." * comparison.unconfirmed


def _first_of(what: str, names: Sequence[str]) -> str:
    more = f", and {len(names) - 1} more" if len(names) > 1 else ""
    return f" {what}: {names[0]}{more}." if names else ""


def verdicts(comparison: Comparison) -> doc.Section:
    wanted = comparison.base.verdicts
    blocks: list[doc.Block] = compare_best.worst(comparison)
    if wanted:
        note = "In brackets the difference from the base, in the unit of the requirement."
        heads = [
            doc.of(label, "what", "Requirement"),
            doc.of(lambda verdict: limit_words(verdict.requirement), "limit", "Limit"),
        ]
        title = "Requirements of every design"
        blocks += _side_by_side(title, wanted, heads, batches(comparison), _verdict_cell, note)
    for one in comparison.all:
        named: list[doc.VerdictItem] = [{**item(v), "id": f"{one.variant.slug}/{v.id}"} for v in one.verdicts]
        blocks += [doc.details(f"Verdicts of {one.variant.name}", [doc.verdicts(named)])] if named else []
    refused, most = comparison.refused, compare_best.MANY
    blocks += [doc.text(f"{one.name}: no design. {one.error}") for one in refused[:most]]
    blocks += [doc.text(f"{len(refused) - most} more have no design.")] if len(refused) > most else []
    status: doc.Status = "fail" if refused else comparison.tally.role
    words = result(comparison)
    return doc.section("verdicts", "Requirements side by side", blocks, result=words, status=status)


def batches(comparison: Comparison) -> list[list[Compared]]:
    """Divide the designs into tables that fit a page, each with the base first."""
    others = [one for one in comparison.all if one is not comparison.base]
    stretches = [others[k : k + COLUMNS] for k in range(0, len(others), COLUMNS)] or [[]]
    return [[comparison.base, *stretch] for stretch in stretches]


def _side_by_side(
    title: str, items: Sequence[Any], heads: list[doc.Shown], batches: Sequence[Sequence[Compared]],
    cell: Callable[[Compared, Any], Any], note: str = "",
) -> list[doc.Block]:  # fmt: skip
    """Tables with a row an item and a column a design; ``cell`` is what a design has of an item."""
    blocks = []
    for part, designs in enumerate(batches, 1):
        each = enumerate(designs)
        own = [doc.of(partial(cell, one), f"d{k}", one.variant.name, align="right") for k, one in each]
        heading = title if part == 1 else f"{title}, part {part}"
        blocks.append(doc.listing(heading, items, [*heads, *own], note if part == 1 else ""))
    return blocks


def _verdict_cell(one: Compared, wanted: RequirementVerdict) -> doc.Cell:
    verdict = next((v for v in one.verdicts if v.figure == wanted.figure), None)
    if verdict is None or verdict.value is None:
        words = "not stable" if verdict is not None and verdict.loop in one.unstable else "none"
        return {"text": words, "status": verdict.role if verdict else "info"}
    change = 0.0 if wanted.value is None else verdict.value - wanted.value
    factor = shown_unit(wanted.requirement.unit)[1]
    return {"text": _with_change(factor * verdict.value, factor * change), "status": verdict.role}


def _with_change(value: float, change: float) -> str:
    """Write a value, in brackets how far it is from the base where that is seen."""
    return (number(value) or "") + (f" ({_signed(change)})" if abs(change) > SEEN * abs(value) else "")


def _signed(value: float) -> str:
    return show_signed(value) if math.isfinite(value) else "unlimited"


def figures(comparison: Comparison) -> doc.Section:
    head, parts = doc.of(lambda name: capital(name.label), "figure", "Figure"), batches(comparison)
    blocks: list[doc.Block] = []
    for group, title in GROUPS.items():
        if names := [name for name in comparison.names if name.group == group]:
            note = _step_of(comparison) if group == "large" else ""
            blocks += _of_figures(title, names, head, comparison, parts, note)
    variants = comparison.everything.variants
    moved = sum(bool(one.differences) or one.unstable != comparison.base.unstable for one in variants)
    result = f"{moved} of {len(variants)} variants change a figure of the base."
    return doc.section("figures", "Figures side by side", blocks, result=result, intro=_MARKS)


def _step_of(comparison: Comparison) -> str:
    """The command behind the large signals, which all designs of its kind get."""
    base = comparison.base.variant.design
    assert base is not None
    size = command_unit(base).of(LargeSignal.plan(base).step)
    return f"Steps of {size} from rest, with friction and every limit; a dash: not reached."


def _of_figures(
    title: str, names: Sequence[FigureName], head: doc.Shown, of: Comparison,
    parts: Sequence[Sequence[Compared]], note: str = "",
) -> list[doc.Block]:  # fmt: skip
    all_designs = of.everything.all
    scaled = {
        name.key: row_unit(name.unit, (one.figures.get(name.key) for one in all_designs)) for name in names
    }
    unit = doc.of(lambda name: scaled[name.key][1], "unit", "Unit")
    return _side_by_side(title, names, [head, unit], parts, partial(_cell, of, scaled), note)


def _cell(
    comparison: Comparison, scaled: Mapping[str, tuple[float, str]], one: Compared, name: FigureName
) -> str | None:
    value = one.figures.get(name.key)
    if value is None:
        return None
    scale, _ = scaled[name.key]
    words = _with_change(scale * value, scale * one.differences.get(name.key, 0.0))
    best, worst = (number(scale * end) for end in comparison.ends(name) or (0.0, 0.0))
    marks = {} if best == worst else {best: " ▲", worst: " ▽"}  # none where all show the same digits
    return words + marks.get(number(scale * value), "")


def differences(comparison: Comparison) -> doc.Section:
    blocks: list[doc.Block] = []
    for one in comparison.variants:
        keys = "; ".join(f"{c.path}: {c.base} → {c.text}" for c in one.changed)
        heading = f"{one.variant.name}: {keys}"[:400]
        same = not (one.changed or one.differences)
        equal = doc.text(f"{one.variant.name}: equal to the base.")
        lost = [doc.text(f"Not stable: {unstable_words(one)}. It has no figures.")] if one.unstable else []
        blocks.append(equal if same else doc.details(heading, [*lost, _moved_table(one, comparison)]))
    intro = (
        "Each changed key is applied alone to the base, over the exact sampled loops. What the keys do not "
        "explain is their interaction. Large-signal figures are not taken apart."
    )
    variants = comparison.everything.variants
    moved = sum(bool(one.changed) for one in variants)
    result = f"{moved} of {len(variants)} variants change a key of the base."
    return doc.section("differences", "Cause of each change", blocks, result=result, intro=intro)


def _moved_table(one: Compared, comparison: Comparison) -> doc.Block:
    def movers(name: FigureName) -> str:
        parts = one.moved_by.get(name.key, ())[:_MOST_MOVERS]
        return ", ".join(f"{part.path} {_signed(part.amount)}" for part in parts)

    def interaction(name: FigureName) -> float | None:
        parts, total = one.moved_by.get(name.key, ()), one.differences[name.key]
        rest = total - sum(part.amount for part in parts)
        return rest if parts and abs(rest) > 1e-3 * abs(total) else None

    columns = [
        _OF_GROUP,
        doc.of(lambda name: unit_words(name.unit), "unit", "Unit"),
        doc.of(lambda name: comparison.base.figures[name.key], "base", "Base", format="sig:4"),
        doc.of(lambda name: one.figures[name.key], "value", "Variant", format="sig:4"),
        doc.of(lambda name: one.differences[name.key], "difference", "Difference", format="sig:3"),
        doc.of(movers, "moved", "Cause"),
        doc.of(interaction, "rest", "Interaction", format="sig:2"),
    ]
    names = [name for name in comparison.names if name.key in one.differences]
    return doc.listing(f"{one.variant.name} against the base", names, columns)


ROUNDING = 1e-9  # of a value


def predictions(comparison: Comparison) -> list[doc.Section]:
    tested = [one for one in comparison.all if one.checks or one.untested]
    if not tested:
        return []
    tables: dict[tuple[str, str], dict[str, Check]] = {}
    for entry in (entry for one in tested for entry in one.checks):
        tables.setdefault((entry.loop, entry.condition), {}).setdefault(entry.name, entry)
    heads = [
        doc.of(lambda entry: capital(quantity_name(entry)), "what", "Prediction"),
        doc.of(lambda entry: unit_words(entry.unit), "unit", "Unit"),
    ]
    parts = [tested[k : k + COLUMNS + 1] for k in range(0, len(tested), COLUMNS + 1)]
    blocks: list[doc.Block] = []
    for (loop, condition), wanted in tables.items():
        title = f"{loop_name(loop)}: {condition}"
        blocks += _side_by_side(title, list(wanted.values()), heads, parts, _prediction_cell)
    blocks += [doc.text(f"{one.variant.name}: not tested. {one.untested}") for one in tested if one.untested]
    tally = Tally.of(entry.verdict for one in comparison.everything.all for entry in one.checks)
    result = f"{tally.words('predictions')}."
    intro = (
        "Simulated values, or the relative error of a response; in brackets the difference from the linear "
        "prediction where it is more than rounding."
    )
    title = "Predictions and simulation"
    return [doc.section("predictions", title, blocks, result=result, intro=intro, status=tally.role)]


def _prediction_cell(one: Compared, wanted: Check) -> doc.Cell:
    entry = next((each for each in one.checks if each.key == wanted.key), None)
    if entry is None:
        return None
    status = entry.verdict.role()
    if entry.found is None or entry.predicted is None or not math.isfinite(entry.found):
        return {"text": f"±{entry.error:.1e}" if math.isfinite(entry.error) else "none", "status": status}
    words, difference = significant(entry.found, 4), entry.found - entry.predicted
    if abs(difference) > ROUNDING * abs(entry.predicted):
        words += f" ({'+' if difference > 0 else ''}{significant(difference, 2)})"
    return {"text": words, "status": status}
