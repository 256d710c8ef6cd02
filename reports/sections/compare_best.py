"""Which variant is best for what, and what each gives up; of very many designs those at the ends.

A page of ten thousand designs would be hundreds of megabytes. Shown are best and worst of each requirement
and figure, those with the most and the least room.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from actuator_lti.asked.quantities import reserve
from actuator_lti.asked.verdict import Verdict
from analyses.comparison.variants import Compared, Comparison
from analyses.specification.requirements import RequirementVerdict, tally
from reports import document as doc
from reports.nightly.text import csv_text
from reports.numbers import significant
from reports.sections.names import LOOPS
from reports.sections.requirements import item, label, limit_words, nearer_limit

SEEN = 5e-5  # relative; a smaller difference changes no digit that is shown
_MOST = 3
_NOTE = "Gains and losses are changes of the distance to the limit, in percent of the limit."


def section(comparison: Comparison) -> doc.Section:
    id, title = "best", "Which variant for what"
    if not comparison.base.verdicts:
        return doc.section(id, title, [], result="The base states no requirement.")
    everything = comparison.everything
    met = [one for one in everything.all if failed(one) == 0]
    words = f"None of the {len(everything.all)} designs meets every requirement."
    if met:
        best = max(met, key=lambda one: weakest(one)[0])
        near, verdict = weakest(best)
        room = "" if verdict is None else f": {100.0 * near:.0f} % to its nearest limit ({label(verdict)})"
        words = f"{len(met)} of {len(everything.all)} designs meet every requirement; "
        words += f"{best.variant.name} has the most room{room}."
    intro = (
        "Distance is what is left to the limit, as part of the limit; of a margin, as part of the "
        "distance from -1 that the limit keeps."
    )
    missed = len(met) < len(everything.all) or bool(everything.refused)
    blocks, status = [designs(comparison), _best(everything)], Verdict.of(not missed).role()
    return doc.section(id, title, blocks, result=words, intro=intro, status=status)


def failed(one: Compared) -> int:
    return sum(not v.passes for v in one.verdicts)


def nearness(verdict: RequirementVerdict) -> float | None:
    """What is left to the nearer limit as a share of it; ``None`` where either is missing.

    Minus infinity for a figure of a loop that is not stable: it is not met, and there is none.
    """
    value, distance, (limit, _) = verdict.value, verdict.distance, nearer_limit(verdict)
    if value is None and verdict.verdict == Verdict.NOT_MET:
        return -math.inf
    if value is None or distance is None or not math.isfinite(distance) or not limit:
        return None
    return reserve(verdict.requirement.quantity, value, limit, distance)


def weakest(one: Compared) -> tuple[float, RequirementVerdict | None]:
    """The smallest distance to a limit as part of it, and whose it is."""
    known = [(near, v) for v in one.verdicts if (near := nearness(v)) is not None]
    return min(known, key=lambda pair: pair[0], default=(math.inf, None))


def designs(comparison: Comparison, note: str = _NOTE) -> doc.Block:
    """One row a design: what it meets and misses, its weakest point, gains and losses against the base."""
    base = comparison.base
    open_ones = any(_those(one, Verdict.NOT_PROVEN) for one in comparison.all)

    def nearest(one: Compared) -> str:
        near, verdict = weakest(one)
        if one.unstable:
            return f"not stable: {unstable_words(one)}"
        return "" if verdict is None else f"{label(verdict)}, {_percent(near)}"

    columns = [
        doc.of("variant.name", "design", "Design"),
        doc.of(lambda o: f"{tally(o.verdicts).met} of {len(o.verdicts)}", "met", "Met"),
        doc.of(lambda o: _those(o, Verdict.NOT_MET), "missed", "Not met"),
        *([doc.of(lambda o: _those(o, Verdict.NOT_PROVEN), "unproven", "Not proven")] if open_ones else []),
        doc.of(nearest, "weakest", "Nearest to its limit"),
        doc.of(lambda o: "the base" if o is base else _changes(o, comparison, 1), "gains", "Gains most"),
        doc.of(lambda o: "" if o is base else _changes(o, comparison, -1), "gives", "Gives up most"),
    ]
    return doc.listing("Each design", comparison.all, columns, note, lambda one: tally(one.verdicts).role)


def unstable_words(one: Compared) -> str:
    return ", ".join(LOOPS[name] for name in one.unstable)


def _those(one: Compared, word: Verdict) -> str:
    return ", ".join(v.id for v in one.verdicts if v.verdict == word)


def _changes(one: Compared, comparison: Comparison, sign: int) -> str:
    """Say what a variant gains (+1) or loses (-1) of each distance, the most first."""
    base = {v.figure: nearness(v) for v in comparison.base.verdicts}
    known = [(label(v), nearness(v), base.get(v.figure)) for v in one.verdicts]
    moved = [(name, now - before) for name, now, before in known if now is not None and before is not None]
    moved = sorted((pair for pair in moved if sign * pair[1] > SEEN), key=lambda pair: -abs(pair[1]))
    words = [f"{name} {_percent(change, signed=True)}" for name, change in moved[:_MOST]]
    words += [f"{len(moved) - _MOST} more"] if len(moved) > _MOST else []
    return "; ".join(words) or "nothing"


def _percent(part: float, *, signed: bool = False) -> str:
    if math.isinf(part):
        return "lost" if part < 0.0 else "regained"
    return f"{'+' * (signed and part > 0)}{significant(100.0 * part, 2)} %"


def _best(comparison: Comparison) -> doc.Block:
    heads = {"what": "Requirement", "limit": "Limit", "best": "Best", "value": "Value", "base": "Base"}
    heads["worst"] = "Worst"
    columns = [
        doc.column(key, words, align="right" if key in ("value", "base") else "left")
        for key, words in heads.items()
    ]
    rows = []
    for wanted in comparison.base.verdicts:
        found = [(nearness(v), one.variant.name, v) for one, v in _judged(comparison, wanted)]
        ranked = [(near, name, number(v.value)) for near, name, v in found if near is not None]
        row = {"what": label(wanted), "limit": limit_words(wanted.requirement), "base": number(wanted.value)}
        if ranked:
            high, low = max(ranked, key=lambda r: r[0]), min(ranked, key=lambda r: r[0])
            first, *equal = [name for _, name, shown in ranked if shown == high[2]]  # the base is first
            same = low[2] == high[2]
            best = first + f"; {len(equal)} equal" * bool(equal)
            row |= {"best": "all equal" if same and equal else best, "value": high[2]}
            row["worst"] = "" if same else f"{low[1]}: {low[2] or 'not stable'}"
        rows.append(row)
    return doc.table("Best design of each requirement", columns, rows)


def _judged(comparison: Comparison, wanted: RequirementVerdict) -> list[tuple[Compared, RequirementVerdict]]:
    return [(one, v) for one in comparison.all for v in one.verdicts if v.figure == wanted.figure]


def number(value: float | None) -> str | None:
    return None if value is None else significant(value, 4) if math.isfinite(value) else "unlimited"


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
    variants = comparison.variants
    room = sorted(range(len(variants)), key=lambda k: (failed(variants[k]), -weakest(variants[k])[0]))
    yield room[0]
    for wanted in comparison.base.verdicts:
        near = {k: nearness(v) for k in room for v in variants[k].verdicts if v.figure == wanted.figure}
        yield from _least_and_most(near)
    yield from (*room[:_MOST_ROOM], *room[-_MOST_ROOM:])
    for name in comparison.names:
        yield from _least_and_most({k: variants[k].figures.get(name.key) for k in room})


def _least_and_most(values: Mapping[int, float | None]) -> tuple[int, ...]:
    """Where the least and the largest of the values that are there stand."""
    known = {k: value for k, value in values.items() if value is not None and not math.isnan(value)}
    return (min(known, key=known.__getitem__), max(known, key=known.__getitem__)) if known else ()


def worst(comparison: Comparison) -> list[doc.Block]:
    """The verdict of each requirement on all designs: that of the worst one; nothing where all are shown."""
    whole = comparison.whole
    if whole is None:
        return []
    count, items = len(whole.all), list[doc.VerdictItem]()

    def rank(pair: tuple[Compared, RequirementVerdict]) -> tuple[int, float]:
        near = nearness(pair[1])
        return _ORDER[pair[1].verdict], math.inf if near is None else near

    for wanted in whole.base.verdicts:
        found = _judged(whole, wanted)
        one, verdict = min(found, key=rank)
        made, met = item(verdict), tally(v for _, v in found).met
        words = f"{made['label']}: met by {met} of {count} designs; the worst is {one.variant.name}"
        items.append({**made, "id": f"worst/{made['id']}", "label": words})
    return [doc.verdicts(items)]


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
    header = ["design", "met", "not_met", "not_proven", "unstable", "weakest", "room_percent"]
    header += [f"{name.key} [{name.unit}]" for name in comparison.names]
    header += [f"requirement {one.id} [{one.requirement.unit}]" for one in comparison.base.verdicts]
    rows: list[list[object]] = []
    for one in comparison.all:
        (near, verdict), count = weakest(one), tally(one.verdicts)
        values = {v.figure: v.value for v in one.verdicts}
        least = (None, None) if verdict is None or math.isinf(near) else (verdict.id, 100.0 * near)
        figures = [one.figures.get(name.key) for name in comparison.names]
        asked = [values.get(wanted.figure) for wanted in comparison.base.verdicts]
        counts = (count.met, count.not_met, count.not_proven, " ".join(one.unstable))
        rows.append([one.variant.name, *counts, *least, *figures, *asked])
    return csv_text(header, rows)
