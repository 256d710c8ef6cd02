"""The validator's ledgers of several designs, side by side."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from reports import document as doc
from reports.document_schema import Block, Row, Section, Status
from reports.numbers import significant
from reports.sections.names import LOOPS, QUANTITIES

if TYPE_CHECKING:
    from analyses.validation.ledger import Entry
    from analyses.variants import Compared, Comparison

Key = tuple[str, str, str]
COLUMNS = 5  # designs in one table: what reads on one screen


def sections(comparison: Comparison) -> list[Section]:
    """Make the section; nothing where no design was validated."""
    tested = [one for one in comparison.all if one.ledger or one.untested]
    if not tested:
        return []
    keys = dict.fromkeys(_key(entry) for one in tested for entry in one.ledger)
    conditions = dict.fromkeys((loop, condition) for loop, _, condition in keys)
    blocks: list[Block] = []
    for loop, condition in conditions:
        wanted = [key for key in keys if key[0] == loop and key[2] == condition]
        batches = (tested[k : k + COLUMNS] for k in range(0, len(tested), COLUMNS))
        blocks += [_table(loop, condition, wanted, batch) for batch in batches]
    blocks += [doc.text(f"{one.variant.name}: not tested. {one.untested}") for one in tested if one.untested]
    judged = [
        entry.passed for one in comparison.everything.all for entry in one.ledger if entry.passed is not None
    ]
    failed = judged.count(False)
    result = f"{len(judged) - failed} of {len(judged)} linear predictions agree with the simulation."
    intro = (
        "Simulated values; in brackets the difference from the linear prediction. Marked: within the "
        "tolerance, "
        "outside, or not judged because the prediction need not hold there."
    )
    status: Status = "fail" if failed else "pass"
    return [
        doc.section("ledger", "Predictions and simulation", blocks, result=result, intro=intro, status=status)
    ]


def _key(entry: Entry) -> Key:
    return (entry.loop, entry.quantity, entry.condition)


def _table(loop: str, condition: str, keys: list[Key], tested: list[Compared]) -> Block:
    units = {_key(entry): entry.unit for one in tested for entry in one.ledger}
    columns = [doc.column("what", "Prediction"), doc.column("unit", "Unit")]
    columns += [doc.column(f"d{k}", one.variant.name, align="right") for k, one in enumerate(tested)]
    known = [{_key(entry): entry for entry in one.ledger} for one in tested]
    rows = []
    for key in keys:
        unit = units.get(key, "")
        row: Row = {
            "what": _title(QUANTITIES.get(key[1], key[1])),
            "unit": "" if unit == "1" else unit,
        }
        rows.append(row | {f"d{k}": _cell(result.get(key)) for k, result in enumerate(known)})
    return doc.table(f"{LOOPS.get(loop, loop)}: {condition}", columns, rows)


def _title(words: str) -> str:
    return words[:1].upper() + words[1:]


def _cell(entry: Entry | None) -> dict[str, str] | None:
    if entry is None:
        return None
    status = {True: "pass", False: "fail", None: "info"}[entry.passed]
    if entry.measured is None or not math.isfinite(entry.measured):
        return {"text": "none", "status": status}
    words = significant(entry.measured, 4)
    difference = entry.difference
    if difference is not None and math.isfinite(difference):
        words += f" ({'+' if difference > 0 else ''}{significant(difference, 2)})"
    return {"text": words, "status": status}
