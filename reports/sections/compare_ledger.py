"""The validator's ledgers of several designs, side by side."""

from __future__ import annotations

import math

from actuator_lti.asked.verdict import Tally
from analyses.comparison.variants import Compared, Comparison
from analyses.validation.row import Row as Check
from reports import document as doc
from reports.document_schema import Block, Row, Section
from reports.numbers import capital, significant
from reports.sections.names import unit_words
from reports.sections.validation import loop_name, quantity_name

Key = tuple[str, str, str]
ROUNDING = 1e-9  # of a value
COLUMNS = 5  # designs in one table: what reads on one screen


def sections(comparison: Comparison) -> list[Section]:
    """Make the section; nothing where no design was validated."""
    tested = [one for one in comparison.all if one.checks or one.untested]
    if not tested:
        return []
    keys = dict.fromkeys(_key(entry) for one in tested for entry in one.checks)
    conditions = dict.fromkeys((loop, condition) for loop, _, condition in keys)
    blocks: list[Block] = []
    for loop, condition in conditions:
        wanted = [key for key in keys if key[0] == loop and key[2] == condition]
        batches = (tested[k : k + COLUMNS] for k in range(0, len(tested), COLUMNS))
        blocks += [_table(loop, condition, wanted, batch) for batch in batches]
    blocks += [doc.text(f"{one.variant.name}: not tested. {one.untested}") for one in tested if one.untested]
    tally = Tally.of(entry.verdict for one in comparison.everything.all for entry in one.checks)
    result = f"{tally.words('predictions')}."
    intro = (
        "Simulated values, or the relative error of a response; in brackets the difference from the linear "
        "prediction where it is more than rounding."
    )
    title = "Predictions and simulation"
    return [doc.section("ledger", title, blocks, result=result, intro=intro, status=tally.role)]


def _key(entry: Check) -> Key:
    return (entry.loop, entry.name, entry.condition)


def _table(loop: str, condition: str, keys: list[Key], tested: list[Compared]) -> Block:
    units = {_key(entry): entry.unit for one in tested for entry in one.checks}
    columns = [doc.column("what", "Prediction"), doc.column("unit", "Unit")]
    columns += [doc.column(f"d{k}", one.variant.name, align="right") for k, one in enumerate(tested)]
    known = [{_key(entry): entry for entry in one.checks} for one in tested]
    names = {_key(entry): quantity_name(entry) for one in tested for entry in one.checks}
    rows = []
    for key in keys:
        unit = units.get(key, "")
        row: Row = {"what": capital(names[key]), "unit": unit_words(unit)}
        rows.append(row | {f"d{k}": _cell(result.get(key)) for k, result in enumerate(known)})
    return doc.table(f"{loop_name(loop)}: {condition}", columns, rows)


def _cell(entry: Check | None) -> dict[str, str] | None:
    if entry is None:
        return None
    status = entry.verdict.role()
    if entry.found is None or entry.predicted is None or not math.isfinite(entry.found):
        return {"text": f"±{entry.error:.1e}" if math.isfinite(entry.error) else "none", "status": status}
    words, difference = significant(entry.found, 4), entry.found - entry.predicted
    if abs(difference) > ROUNDING * abs(entry.predicted):
        words += f" ({'+' if difference > 0 else ''}{significant(difference, 2)})"
    return {"text": words, "status": status}
