"""The figures of a report: every number that it states, under the same name every night."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from actuator_lti.asked.quantities import reserve
from actuator_lti.asked.verdict import Tally
from actuator_lti.files.tree import Tree
from reports.nightly.text import one_line
from reports.verdict_summary import role, verdict_words, why

MAX_FIGURES = 5_000
MAX_TABLE_ROWS = 200
REQUIREMENTS = "requirements"  # verdicts on the design's own requirements; others are checks and odds
_NO_RESULTS = ("Where the time went",)  # tables that differ from run to run
_INPUT_SECTIONS = ("parameters", "provenance")


@dataclass(frozen=True, kw_only=True)
class Figure:
    """One number of a report; ``better`` says which way is (see `reports.document.column`)."""

    name: str
    value: float | None
    unit: str = ""
    better: int = 0
    kind: str = "figure"


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One requirement: ``distance`` is positive where it is met; ``waiver`` of one that is not proven."""

    id: str
    label: str
    value: float | None
    limit: str
    unit: str
    distance: float | None
    relative: float | None
    verdict: str
    waiver: str = ""
    source: str = ""
    reason: str = ""
    what: str = REQUIREMENTS

    @property
    def role(self) -> str:
        """Its colour."""
        return role(asdict(self))

    @property
    def why(self) -> str:
        """What stands beside its word."""
        return why(asdict(self))


def digest(document: Mapping[str, Any]) -> Tree:
    """What the nightly keeps of a report document: figures, verdicts, title, revision (plain JSON)."""
    verdicts = list(verdicts_of(document))
    parts = document["verdict"]["parts"]
    count = sum((Tally(**part) for part in parts.values()), Tally())
    figures = list(figures_of(document))
    design = document.get("design") or {}
    return {
        "title": str(document.get("title", "")),
        "revision": str(design.get("revision", "") or ""),
        "verdicts": [asdict(v) for v in verdicts],
        "figures": [asdict(f) for f in figures[:MAX_FIGURES]],
        "words": verdict_words({"parts": parts}),
        "failed": count.not_met,
        "unproven": count.not_proven + len(document["verdict"].get("unproven_sections", ())),
        "total": count.total,
        "failed_sections": [
            one_line(str(part.get("title", "")), 120)
            for part in document.get("sections", ())
            if part.get("status") == "fail" and not _has_failed_verdict(part)
        ],
    }


def _has_failed_verdict(part: Mapping[str, Any]) -> bool:
    blocks = [block for _, block in _nested("", part.get("blocks", ()))]
    items = [item for block in blocks if block.get("kind") == "verdicts" for item in block.get("items", ())]
    return any(item["verdict"] == "not met" for item in items)


def verdicts_of(document: Mapping[str, Any]) -> Iterator[Verdict]:
    """Return the requirements of a document, each once, in its order."""
    seen: set[str] = set()
    for _, block in _blocks(document):
        if block.get("kind") != "verdicts":
            continue
        for item in block.get("items", ()):
            name = one_line(str(item.get("id", "")), 200)
            if name in seen:
                continue
            seen.add(name)
            yield _verdict(name, item, str(block.get("what", REQUIREMENTS)))


def _verdict(name: str, item: Mapping[str, Any], what: str) -> Verdict:
    """Make a verdict; one that the design does not require is ranked only where it fails."""
    distance = number(item.get("distance"))
    limit = number(item.get("limit"))
    if limit is None:
        limit = first_number(str(item.get("limit", "")))
    value = number(item.get("value"))
    left = None
    if distance is not None and (what == REQUIREMENTS or item["verdict"] == "not met"):
        of = str(item.get("quantity", ""))
        left = distance if limit is None or value is None else reserve(of, value, limit, distance)
    return Verdict(
        id=name,
        label=str(item.get("label", "") or name),
        value=value,
        limit=_limit_text(item),
        unit=str(item.get("unit", "") or ""),
        distance=distance,
        relative=left,
        verdict=item["verdict"],
        waiver=item["waiver"],
        source=str(item.get("source", "") or ""),
        reason=str(item.get("reason", "") or ""),
        what=what,
    )


def _limit_text(item: Mapping[str, Any]) -> str:
    limit = item.get("limit")
    if limit is None:
        return ""
    text = f"{limit:.6g}" if _is_number(limit) else str(limit)
    comparison = str(item.get("comparison") or "")
    return f"{comparison} {text}".strip()


def figures_of(document: Mapping[str, Any]) -> Iterator[Figure]:
    """Return every number of verdicts, facts and tables; the inputs (parameters, provenance) are none."""
    seen: set[str] = set()
    for verdict in verdicts_of(document):
        kind = "requirement" if verdict.what == REQUIREMENTS else "check"
        yield Figure(name=f"{verdict.id}: value", value=verdict.value, unit=verdict.unit, kind=kind)
        yield Figure(
            name=f"{verdict.id}: distance",
            value=verdict.distance,
            unit=verdict.unit,
            better=1,
            kind="distance",
        )
        met = {"met": 1.0, "not met": 0.0}.get(verdict.verdict)
        yield Figure(name=f"{verdict.id}: met", value=met, kind="verdict")
    for section, block in _blocks(document):
        if section in _INPUT_SECTIONS:
            continue
        for figure in _of_block(section, block):
            if figure.name not in seen:
                seen.add(figure.name)
                yield figure


def _blocks(document: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    for section in document.get("sections", ()):
        yield from _nested(str(section.get("id", "")), section.get("blocks", ()))


def _nested(section: str, blocks: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    for block in blocks:
        if block.get("kind") == "details":
            yield from _nested(section, block.get("blocks", ()))
        else:
            yield section, block


def _of_block(section: str, block: Mapping[str, Any]) -> Iterator[Figure]:
    if block.get("kind") == "facts":
        for item in block.get("items", ()):
            value = number(item.get("value"))
            if value is not None:
                name = f"{section} / {one_line(str(item.get('label', '')), 120)}"
                yield Figure(
                    name=name, value=value, unit=str(item.get("unit", "") or ""), better=_direction(item)
                )
    elif block.get("kind") == "table" and len(block.get("rows", ())) <= MAX_TABLE_ROWS:
        yield from _of_table(section, block)


def _of_table(section: str, block: Mapping[str, Any]) -> Iterator[Figure]:
    """Name each number by caption, row and column; a row by its texts in front of the first number."""
    if block.get("caption") in _NO_RESULTS:
        return
    columns, rows = block.get("columns", ()), block.get("rows", ())
    numeric = [c for c in columns if any(_is_number(r.get(c["key"])) for r in rows)]
    first = columns.index(numeric[0]) if numeric else 0
    names = [c["key"] for c in columns[: max(first, 1)] if c not in numeric]
    caption = one_line(str(block.get("caption", "")), 60)
    counts: dict[str, int] = {}
    for row in rows:
        label = " / ".join(one_line(row[k], 60) for k in names if isinstance(row.get(k), str) and row[k])
        counts[label] = counts.get(label, 0) + 1
        if counts[label] > 1:
            label = f"{label} ({counts[label]})"
        for column in numeric:
            value, words = row.get(column["key"]), str(column.get("label", "") or column["key"])
            if value is None or _is_number(value):
                yield Figure(
                    name=f"{section} / {caption} / {label} / {one_line(words, 40)}",
                    value=number(value),
                    unit=str(column.get("unit", "") or ""),
                    better=_direction(column),
                )


def _direction(shown: Mapping[str, Any]) -> int:
    """As the section declares it."""
    better = shown.get("better", 0)
    return better if better in (-2, -1, 0, 1, 2) else 0


def _is_number(value: object) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool)


def number(value: object) -> float | None:
    """Return a finite number, or ``None`` for anything else."""
    if isinstance(value, float | int) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    return None


def first_number(text: str) -> float | None:
    """Return the first number in a text such as ``>= 6 dB``."""
    for word in text.replace("≥", " ").replace("≤", " ").replace(">", " ").replace("<", " ").split():
        try:
            value = float(word.strip("=,;"))
        except ValueError:
            continue
        if math.isfinite(value):
            return value
    return None
