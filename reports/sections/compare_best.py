"""One page of a comparison: which variant is best for what, and what each gives up."""

from __future__ import annotations

import math
from collections.abc import Sequence

from actuator_lti.asked.quantities import reserve
from actuator_lti.asked.verdict import Verdict
from analyses.comparison.variants import Compared, Comparison
from analyses.specification.requirements import RequirementVerdict, tally
from reports import document as doc
from reports.document_schema import Block, Section
from reports.numbers import significant
from reports.sections.requirements import label, limit_words

_SEEN = 5e-5  # relative; a smaller difference changes no digit that is shown
_MOST = 3
_NOTE = "Gains and losses are changes of the distance to the limit, in percent of the limit."


def section(comparison: Comparison) -> Section:
    """Make the section: the best design of each requirement, and each variant's gains and losses."""
    wanted = comparison.base.verdicts
    if not wanted:
        return doc.section("best", "Which variant for what", [], result="The base states no requirement.")
    everything = comparison.everything
    blocks = [designs(comparison), _best(everything)]
    met = [one for one in everything.all if failed(one) == 0]
    missed = len(met) < len(everything.all) or bool(everything.refused)
    return doc.section(
        "best", "Which variant for what", blocks, result=_result(everything, met),
        intro=(
            "Distance is what is left to the limit, as part of the limit; of a margin, as part of the "
            "distance from -1 that the limit keeps."
        ),
        status="fail" if missed else "pass",
    )  # fmt: skip


def _result(comparison: Comparison, met: Sequence[Compared]) -> str:
    """Say how many designs meet everything, and which has the most room."""
    count = len(comparison.all)
    if not met:
        return f"None of the {count} designs meets every requirement."
    best = max(met, key=lambda one: weakest(one)[0])
    nearness, verdict = weakest(best)
    room = "" if verdict is None else f": {100.0 * nearness:.0f} % to its nearest limit ({label(verdict)})"
    return (
        f"{len(met)} of {count} designs meet every requirement; {best.variant.name} has the most room{room}."
    )


def failed(one: Compared) -> int:
    """Number of requirements that a design does not meet, or that are not proven of it."""
    return sum(not v.passes for v in one.verdicts)


def nearness(verdict: RequirementVerdict) -> float | None:
    """What is left to the nearer limit as a share of it; ``None`` where either is missing."""
    of = verdict.requirement
    limits = [limit for limit in (of.minimum, of.maximum) if limit]
    if verdict.value is None or verdict.distance is None or not math.isfinite(verdict.distance) or not limits:
        return None
    return reserve(of.quantity, verdict.value, min(limits, key=abs), verdict.distance)


def weakest(one: Compared) -> tuple[float, RequirementVerdict | None]:
    """The smallest distance to a limit as part of it, and whose it is."""
    known = [(near, v) for v in one.verdicts if (near := nearness(v)) is not None]
    return min(known, key=lambda pair: pair[0], default=(math.inf, None))


def designs(comparison: Comparison, note: str = _NOTE) -> Block:
    """One row a design: what it meets and misses, its weakest point, gains and losses against the base."""
    base = comparison.base
    columns = [
        doc.of("variant.name", "design", "Design"),
        doc.of(lambda o: f"{tally(o.verdicts).met} of {len(o.verdicts)}", "met", "Met"),
        doc.of(lambda o: _those(o, Verdict.NOT_MET), "missed", "Not met"),
        doc.of(lambda o: _those(o, Verdict.NOT_PROVEN), "unproven", "Not proven"),
        doc.of(_weakest_words, "weakest", "Nearest to its limit"),
        doc.of(lambda o: "the base" if o is base else _changes(o, comparison, 1), "gains", "Gains most"),
        doc.of(lambda o: "" if o is base else _changes(o, comparison, -1), "gives", "Gives up most"),
    ]
    return doc.listing("Each design", comparison.all, columns, note, lambda one: tally(one.verdicts).role)


def _those(one: Compared, word: Verdict) -> str:
    return ", ".join(v.id for v in one.verdicts if v.verdict == word)


def _weakest_words(one: Compared) -> str:
    near, verdict = weakest(one)
    return "" if verdict is None else f"{label(verdict)}, {_percent(near)}"


def _changes(one: Compared, comparison: Comparison, sign: int) -> str:
    """Say what a variant gains (+1) or loses (-1) of each distance, the most first."""
    base = {v.id: nearness(v) for v in comparison.base.verdicts}
    moved = [
        (label(v), near - before)
        for v in one.verdicts
        if (near := nearness(v)) is not None
        and (before := base.get(v.id)) is not None
        and sign * (near - before) > _SEEN
    ]
    return _words(sorted(moved, key=lambda pair: -abs(pair[1])))


def _words(moved: Sequence[tuple[str, float]]) -> str:
    shown = "; ".join(f"{name} {_percent(change, signed=True)}" for name, change in moved[:_MOST])
    more = len(moved) - _MOST
    return (shown + (f"; {more} more" if more > 0 else "")) or "nothing"


def _percent(part: float, *, signed: bool = False) -> str:
    sign = "+" if signed and part > 0 else ""
    return f"{sign}{significant(100.0 * part, 2)} %"


def _best(comparison: Comparison) -> Block:
    """One row a requirement: the design with the most room, beside the base."""
    columns = [
        doc.column("what", "Requirement"),
        doc.column("limit", "Limit"),
        doc.column("best", "Best"),
        doc.column("value", "Value", align="right"),
        doc.column("base", "Base", align="right"),
        doc.column("worst", "Worst"),
    ]
    rows = []
    for wanted in comparison.base.verdicts:
        ranked = [
            (near, one.variant.name, v)
            for one in comparison.all
            for v in one.verdicts
            if v.id == wanted.id and (near := nearness(v)) is not None
        ]
        row = {"what": label(wanted), "limit": limit_words(wanted.requirement), "base": number(wanted.value)}
        if ranked:
            high, low = max(ranked, key=lambda r: r[0]), min(ranked, key=lambda r: r[0])
            seen = _SEEN * max(abs(high[0]), 1e-9)
            same = high[0] - low[0] <= seen
            alike = [name for near, name, _ in ranked if high[0] - near <= seen]  # the base is first
            row |= {
                "best": "all alike" if same else _first(alike),
                "value": number(high[2].value),
                "worst": "" if same else f"{low[1]}: {number(low[2].value)}",
            }
        rows.append(row)
    return doc.table("Best design of each requirement", columns, rows)


def _first(names: Sequence[str]) -> str:
    """Name the first design, and say how many are as good."""
    return names[0] if len(names) == 1 else f"{names[0]}; {len(names) - 1} alike"


def number(value: float | None) -> str | None:
    """Write a value that may have no bound."""
    if value is None:
        return None
    return significant(value, 4) if math.isfinite(value) else "unlimited"
