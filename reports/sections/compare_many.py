"""Comparisons of more designs than a page can show: some of them on the page, all of them in a table file.

A page of ten thousand designs would be hundreds of megabytes. Shown are the ends: best and worst of each
requirement, those with the most and the least room, best and worst of each figure.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from actuator_lti.asked.verdict import Verdict
from analyses.comparison.variants import Compared, Comparison
from analyses.specification.requirements import RequirementVerdict, tally
from reports import document as doc
from reports.document_schema import Block, VerdictItem
from reports.nightly.text import csv_text
from reports.sections.compare_best import failed, nearness, weakest
from reports.sections.requirements import item

MANY = 60  # designs beside the base that one page shows
_MOST_ROOM = 5
_ORDER = {Verdict.NOT_MET: 0, Verdict.NOT_PROVEN: 1, Verdict.MET: 2}
TABLE = "compare.csv"


def choice(comparison: Comparison) -> Comparison:
    """The comparison as its page shows it: all designs where they are few, else those at the ends."""
    if len(comparison.variants) <= MANY:
        return comparison
    wanted = dict.fromkeys(_ends(comparison))
    places = sorted(k for k, _ in zip(wanted, range(MANY), strict=False))
    return replace(comparison, variants=tuple(comparison.variants[k] for k in places), whole=comparison)


def _ends(comparison: Comparison) -> Iterator[int]:
    """Places of the variants that matter, the most important first."""
    variants = comparison.variants
    room = sorted(range(len(variants)), key=lambda k: (failed(variants[k]), -weakest(variants[k])[0]))
    yield room[0]
    for wanted in comparison.base.verdicts:
        near = {k: value for k in room if (value := _room(variants[k], wanted)) is not None}
        if near:
            yield from (min(near, key=near.__getitem__), max(near, key=near.__getitem__))
    yield from (*room[:_MOST_ROOM], *room[-_MOST_ROOM:])
    for name in comparison.names:
        values = {
            k: v for k in room if (v := variants[k].figures.get(name.key)) is not None and math.isfinite(v)
        }
        if values:
            yield from (min(values, key=values.__getitem__), max(values, key=values.__getitem__))


def _room(one: Compared, wanted: RequirementVerdict) -> float | None:
    return next((nearness(v) for v in one.verdicts if v.id == wanted.id), None)


def worst(comparison: Comparison) -> list[Block]:
    """The verdict of each requirement on all designs: that of the worst one; nothing where all are shown."""
    whole = comparison.whole
    if whole is None:
        return []
    count, items = len(whole.all), list[VerdictItem]()
    for wanted in whole.base.verdicts:
        found = [(one, v) for one in whole.all for v in one.verdicts if v.id == wanted.id]
        one, verdict = min(found, key=lambda pair: _rank(pair[1]))
        made: VerdictItem = item(verdict)
        met = tally(v for _, v in found).met
        label = f"{made['label']}: met by {met} of {count} designs; the worst is {one.variant.name}"
        made["id"], made["label"] = f"worst/{made['id']}", label
        items.append(made)
    return [doc.verdicts(items)]


def _rank(verdict: RequirementVerdict) -> tuple[int, float]:
    near = nearness(verdict)
    return _ORDER[verdict.verdict], math.inf if near is None else near


def shown_words(comparison: Comparison) -> str:
    """What the page leaves out, in words; empty where it shows all."""
    if comparison.whole is None:
        return ""
    return (
        f"This page shows {len(comparison.all)} of {len(comparison.whole.all)} designs: the base, best and "
        "worst of each requirement and figure, those with the most and the least room. The command compare "
        f"writes every figure of all of them to {TABLE}."
    )


def table_text(comparison: Comparison) -> str:
    """A row for each design with every figure and every value of a requirement, as CSV."""
    header = ["design", "met", "not_met", "not_proven", "weakest", "room_percent"]
    header += [f"{name.key} [{name.unit}]" for name in comparison.names]
    header += [f"requirement {one.id} [{one.requirement.unit}]" for one in comparison.base.verdicts]
    return csv_text(header, (_row(one, comparison) for one in comparison.all))


def _row(one: Compared, comparison: Comparison) -> list[object]:
    near, verdict = weakest(one)
    values, count = {v.id: v.value for v in one.verdicts}, tally(one.verdicts)
    least = (None, None) if verdict is None else (verdict.id, 100.0 * near)
    return [
        *(one.variant.name, count.met, count.not_met, count.not_proven, *least),
        *(one.figures.get(name.key) for name in comparison.names),
        *(values.get(wanted.id) for wanted in comparison.base.verdicts),
    ]
