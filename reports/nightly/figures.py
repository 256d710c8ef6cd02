"""The figures of a report: every number that it states, under the same name every night."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import islice
from typing import Any, TypeGuard

from actuator_lti.asked.quantities import reserve
from actuator_lti.asked.verdict import Tally
from actuator_lti.files.reading import Tree
from reports.document_schema import GOES_ON
from reports.nightly.text import one_line
from reports.verdict_summary import role, verdict_words, walk, why

MAX_FIGURES = 5_000
MAX_TABLE_ROWS = 200
REQUIREMENTS = "requirements"  # verdicts on the design's own requirements; others are checks and odds
_INPUT_SECTIONS = ("parameters", "provenance")
_AS_THEY_ARE = ("value", "unit", "distance", "verdict", "waiver", "source", "reason")


@dataclass(frozen=True)
class Figure:
    """One number of a report; ``better`` says which way is (see `reports.document.column`)."""

    name: str
    value: float | None
    unit: str = ""
    better: int = 0
    kind: str = "figure"


def digest(document: Mapping[str, Any]) -> Tree:
    """What the nightly keeps of a report document: figures, verdicts, title, revision (plain JSON)."""
    judged = document["verdict"]
    count = sum((Tally(**part) for part in judged["parts"].values()), Tally())
    return {
        "title": document["title"],
        "revision": document["design"].get("revision") or "",
        "verdicts": verdicts_of(document),
        "figures": [asdict(f) for f in islice(figures_of(document), MAX_FIGURES)],
        "words": verdict_words({"parts": judged["parts"]}),
        "failed": count.not_met,
        "unproven": count.not_proven + len(judged.get("unproven_sections", ())),
        "total": count.total,
        "failed_sections": [one_line(title, 120) for title in judged.get("failed_sections", ())],
    }


def verdicts_of(document: Mapping[str, Any]) -> list[Tree]:
    """Return the requirements of a document, each once, in its order.

    ``distance`` is positive where it is met, ``relative`` its `reserve`; ``limit`` is in words, ``bound``
    the number; ``what`` is `REQUIREMENTS` or the kind of check; ``role`` its colour, ``why`` beside its word.
    """
    made: dict[str, Tree] = {}
    for _, block in _blocks(document):
        for item in block["items"] if block["kind"] == "verdicts" else ():
            name = one_line(item["id"], 200)
            made.setdefault(name, _verdict(name, item, block.get("what", REQUIREMENTS)))
    return list(made.values())


def _verdict(name: str, item: Mapping[str, Any], what: str) -> Tree:
    """Make a verdict; one that the design does not require is ranked only where it fails."""
    value, limit, distance = (item[key] for key in ("value", "limit", "distance"))
    left = None
    if distance is not None and (what == REQUIREMENTS or item["verdict"] == "not met"):
        of = str(item.get("quantity", ""))
        left = distance if limit is None or value is None else reserve(of, value, limit, distance)
    words = "" if limit is None else f"{item['comparison']} {limit:.6g}".strip()
    return {
        "id": name, "label": item["label"] or name, "what": what, "limit": words, "bound": number(limit),
        "relative": left, "role": role(item), "why": why(item), **{key: item[key] for key in _AS_THEY_ARE},
    }  # fmt: skip


def left(verdict: Mapping[str, Any]) -> float:
    """What a verdict is ranked by: minus infinity where not met without a figure, infinity if by none."""
    lost = verdict["value"] is None and verdict["verdict"] == "not met" and verdict["what"] == REQUIREMENTS
    known = -math.inf if lost else verdict["relative"]
    return math.inf if known is None else float(known)


def figures_of(document: Mapping[str, Any]) -> Iterator[Figure]:
    """Return every number of verdicts, facts and tables; the inputs (parameters, provenance) are none."""
    for verdict in verdicts_of(document):
        name, unit = verdict["id"], verdict["unit"]
        kind = "requirement" if verdict["what"] == REQUIREMENTS else "check"
        met = {"met": 1.0, "not met": 0.0}.get(verdict["verdict"])
        yield Figure(f"{name}: value", verdict["value"], unit, kind=kind)
        yield Figure(f"{name}: distance", verdict["distance"], unit, better=1, kind="distance")
        yield Figure(f"{name}: met", met, kind="verdict")
    first: dict[str, Figure] = {}
    for section, block in _blocks(document):
        for figure in () if section in _INPUT_SECTIONS else _of_block(section, block):
            first.setdefault(figure.name, figure)
    yield from first.values()


def _blocks(document: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    return ((section["id"], block) for section in document["sections"] for block in walk(section))


def _of_block(section: str, block: Mapping[str, Any]) -> Iterator[Figure]:
    if block["kind"] == "facts":
        for item in block["items"]:
            if number(item["value"]) is not None:
                yield _figure(f"{section} / {one_line(item['label'], 120)}", item["value"], item)
    elif block["kind"] == "table" and len(block["rows"]) <= MAX_TABLE_ROWS:
        yield from _of_table(section, block)


def _of_table(section: str, block: Mapping[str, Any]) -> Iterator[Figure]:
    """Name each number by caption, row and column; a row by its texts in front of the first number."""
    columns, rows = block["columns"], block["rows"]
    numeric = [c for c in columns if any(_is_number(r.get(c["key"])) for r in rows)]
    first = columns.index(numeric[0]) if numeric else 0
    names = [c["key"] for c in columns[: max(first, 1)] if c not in numeric]
    caption = one_line(block["caption"], 60)
    counts: Counter[str] = Counter()
    for row in rows:
        label = " / ".join(one_line(row[k], 60) for k in names if isinstance(row.get(k), str) and row[k])
        counts[label] += 1
        label += f" ({counts[label]})" * (counts[label] > 1)
        for column, heading in zip(numeric, _headings(numeric), strict=True):
            value, shown = row.get(column["key"]), column
            name = f"{section} / {caption} / {label} / {one_line(heading, 40)}"
            if not column["unit"] and "_scale" in row:  # to the unit of the row, whichever tonight's is
                shown = {**column, "unit": row["_unit"]}
                value = value / row["_scale"] if _is_number(value) else value
            if value is None or _is_number(value):
                yield _figure(name, value, shown)


def _headings(columns: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Name each column by its label; one that goes on with the column before it by that label as well."""
    before = ""
    for column in columns:
        goes_on = column["label"] in GOES_ON
        before = before if goes_on else column["label"]
        more = column["label"] or f"in {column['unit']}"
        yield f"{before} {more}".strip() if goes_on else before


def _figure(name: str, value: object, shown: Mapping[str, Any]) -> Figure:
    return Figure(name=name, value=number(value), unit=shown["unit"], better=shown.get("better", 0))


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, float | int) and not isinstance(value, bool)


def number(value: object) -> float | None:
    """Return a finite number, or ``None`` for anything else."""
    return float(value) if _is_number(value) and math.isfinite(value) else None
