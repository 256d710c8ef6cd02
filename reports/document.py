"""The document that every report, page and PDF is made of: plain JSON, versioned, without NaN.

A document holds sections, a section holds blocks; the builders below make blocks of each kind.
Whoever draws a page reads only this, never the results themselves.
"""

import json
import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial, reduce
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from actuator_lti.asked.quantities import shown_unit
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.model import Design, Waiver
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree, parse_json, read_json, shown, shown_path
from reports.certain import certain
from reports.charts.chart import Chart
from reports.charts.data import chart_data
from reports.charts.svg import refuse_undrawable
from reports.document_schema import (
    SCHEMA,
    VERSION,
    Align,
    Block,
    Cell,
    Column,
    Counts,
    Document,
    FactItem,
    Finding,
    Layout,
    Row,
    Section,
    Severity,
    State,
    Status,
    VerdictItem,
    validate,
)  # fmt: skip
from reports.numbers import prose, show
from reports.verdict_summary import judged, verdict_of, walk
from reports.visible import visible

T = TypeVar("T")
_compact = partial(json.dumps, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
Shown = tuple[Column, Callable[[Any], Any]]

__all__ = ["Cell", "Counts", "Row", "State"]  # besides what stands here


def plain(value: Any, otherwise: Callable[[Any], Any] | None = None) -> Any:
    """Turn numpy values, tuples and mappings into what JSON knows; NaN and infinity become ``None``.

    Anything else (a complex number, an object) ``otherwise`` makes into one of these; without it a TypeError.

    >>> plain({"a": (1, float("nan")), "b": np.float64(2.0)})
    {'a': [1, None], 'b': 2.0}
    """
    if value is None or isinstance(value, bool | str | int):
        return value
    if isinstance(value, np.generic):
        return plain(value.item(), otherwise)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(item, otherwise) for key, item in value.items()}
    if isinstance(value, Iterable):
        items = value.tolist() if isinstance(value, np.ndarray) else value
        return [plain(item, otherwise) for item in items]
    if otherwise is None:
        raise TypeError(f"a report cannot hold a {type(value).__name__}")
    return plain(otherwise(value), otherwise)


def column(
    key: str, label: str, unit: str = "", *, align: Align | None = None, format: str = "text", better: int = 0
) -> Column:
    """Describe a table's column.

    ``format``: ``"text"``, ``"sig:3"`` (significant digits), ``"short:4"`` (the same without trailing zeros),
    ``"fix:1"`` (decimals), ``"gain:1"`` (a gain margin), ``"int"`` (a count), ``"ms:3"`` (ms, or s for a long
    time) or ``"yesno"``.
    ``better`` from night to night: +1 more, -1 less, +2 or -2 that of the magnitude; 0: neither.
    """
    side: Align = align or ("left" if format in ("text", "yesno") else "right")
    made: Column = {"key": key, "label": label, "unit": unit, "align": side, "format": format}
    return {**made, "better": better} if better else made


def table(
    caption: str, columns: Sequence[Column], rows: Iterable[Mapping[str, Any] | Sequence[Any]], note: str = ""
) -> Block:
    """Make a table; a row is a mapping by column key, with ``_status`` where it has one, or its cells."""
    keys = [one["key"] for one in columns]
    named = [row if isinstance(row, Mapping) else dict(zip(keys, row, strict=True)) for row in rows]
    return {
        "kind": "table", "caption": caption, "columns": list(columns), "rows": list(map(plain, named)),
        "note": prose(note),
    }  # fmt: skip


def of(
    read: str | Callable[[Any], Any], key: str, label: str, unit: str = "", *, scale: float = 1.0, **look: Any
) -> Shown:
    """A column of `listing`: a field of the items by its dotted name, or what a function says of one.

    ``scale`` turns a number into ``unit``; what is not there stays nothing. ``look``: as of `column`.

    >>> _, read = of("real.imag", "y", "y", "mm", scale=1e3)
    >>> read(2.0 + 3.0j), read(None)
    (0.0, None)
    """
    made = column(key, label, unit, **look)

    def value(item: Any) -> Any:
        if not isinstance(read, str):
            return read(item)
        return reduce(lambda of, name: None if of is None else getattr(of, name), read.split("."), item)

    if scale == 1.0:
        return made, value
    return made, lambda item: None if (found := value(item)) is None else scale * found


def listing(
    caption: str, items: Iterable[T], columns: Sequence[Shown], note: str = "",
    status: Callable[[T], Status | None] | None = None, more: Callable[[T], Mapping[str, Any]] | None = None,
) -> Block:  # fmt: skip
    """Make a table of items, a row each: every column with what it shows of an item.

    ``more``: what a row says besides, as ``_scale`` (see `reports.document_schema`).

    >>> listing("Parts", [2 + 3j], [of("imag", "y", "y", "mm", scale=1e3)])["rows"]
    [{'y': 3000.0}]
    """
    rows = []
    for item in items:
        said = ({"_status": status(item)} if status else {}) | dict(more(item) if more else {})
        rows.append({**{one["key"]: read(item) for one, read in columns}, **said})
    return table(caption, [one for one, _ in columns], rows, note)


def figure(name: str, chart: Chart, caption: str, *, alt: str = "", layout: Layout = "wide") -> Block:
    """Make a figure of a chart; ``name`` is its kind, such as ``"bode"``.

    The caption says what is seen: a figure must be understood alone. ``alt`` stands for it where it cannot be
    seen; ``layout``: wide, half of the page's width, or tall (half as wide, two rows high).
    """
    return {
        "kind": "figure", "figure": name, "chart": chart_data(chart), "caption": prose(caption),
        "alt": prose(alt or caption), "layout": layout,
    }  # fmt: skip


def with_columns(block: Block, keys: Collection[str]) -> Block:
    """A table with some of its columns only, as a narrow page has room for; any other block as it is."""
    if block["kind"] != "table":
        return block
    return {**block, "columns": [column for column in block["columns"] if column["key"] in keys]}


def text(content: str) -> Block:
    return {"kind": "text", "text": prose(content)}


def remark(words: str) -> Block:
    """Make a paragraph of what a computation had to say: a sentence.

    >>> remark("the loop is cut")["text"], remark("w_ref: no loop.")["text"]
    ('The loop is cut.', 'w_ref: no loop.')
    """
    name = {"_", "."} & set(words.split(" ")[0].strip(".,:"))
    start = words[:1] if name else words[:1].upper()
    return text(start + words[1:] + ("." if words[-1:].isalnum() else ""))


def fact(label: str, value: Any, unit: str = "", *, format: str = "text", better: int = 0) -> FactItem:
    made: FactItem = {"label": label, "value": plain(value), "unit": unit}
    made |= {"format": format} if format != "text" else {}
    return {**made, "better": better} if better else made


def shown_fact(item: Mapping[str, Any]) -> str:
    return show(item["value"], item.get("format", "text"))


def facts(items: Iterable[FactItem]) -> Block:
    return {"kind": "facts", "items": [plain(item) for item in items]}


COMPARISONS = {">=": "≥", "<=": "≤"}


def verdict(
    id: str, label: str, *, passed: bool | Verdict | None, value: float | None = None,
    limit: float | None = None, unit: str = "", distance: float | None = None, source: str = "",
    reason: str = "", comparison: str = "", waiver: Waiver | None = None,
) -> VerdictItem:  # fmt: skip
    """Make one item of `verdicts`; ``distance`` is positive on the good side, by itself where that is known.

    ``passed`` is ``None`` where there was nothing to compare: not proven. ``comparison`` is the good side of
    the limit, ``">="`` or ``"<="``; it is kept as it is printed. Times are told in ms.
    """
    unit, factor = shown_unit(unit)
    value, limit, distance = (one if one is None else factor * one for one in (value, limit, distance))
    if distance is None and value is not None and limit is not None and comparison in COMPARISONS:
        distance = value - limit if comparison == ">=" else limit - value
    return {
        "id": id, "label": label, "value": plain(value), "limit": plain(limit),
        "comparison": COMPARISONS.get(comparison, comparison), "unit": unit, "distance": plain(distance),
        "verdict": Verdict.of(passed).value, "waiver": waiver.words if waiver else "", "source": source,
        "reason": prose(reason),
    }  # fmt: skip


def waived(sections: Iterable[Section], design: Design) -> None:
    """Mark in place the checks not proven that the design file waives; its requirements know it already."""
    for item in judged(block for part in sections for block in walk(part)):
        waiver = design.waiver_of(item["id"]) if item["verdict"] == Verdict.NOT_PROVEN else None
        item["waiver"] = item["waiver"] or (waiver.words if waiver else "")


def verdicts(items: Iterable[VerdictItem], what: str = "requirements") -> Block:
    """Make a list of verdicts; ``what`` is a key of `reports.verdict_summary.WORDS`."""
    return {"kind": "verdicts", "items": [plain(item) for item in items], "what": what}


def details(title: str, blocks: Sequence[Block]) -> Block:
    return {"kind": "details", "title": title, "blocks": list(blocks)}


def section(
    id: str, title: str, blocks: Sequence[Block], *, result: str = "", intro: str = "",
    status: Status | None = None, severity: Severity | None = None, findings: Iterable[Finding] = (),
    verdict: Verdict | None = None,
) -> Section:  # fmt: skip
    """Make a section; ``id`` is its anchor.

    ``result``: one sentence that says what was found, ``intro``: how. ``severity``: how grave the result is,
    where the first screen says it, and its status where that is no other; ``findings``: what else that screen
    has to say. ``verdict`` counts beside the verdicts in it: where it is not proven, so is the document.
    """
    first = [Finding(severity=severity, text=result, where=id)] if severity and result else []
    made: Section = {
        "id": id,
        "title": title,
        "result": prose(result),
        "intro": prose(intro),
        "status": status or severity or "info",
        "blocks": list(blocks),
        "findings": [{**one, "text": prose(one["text"])} for one in (*first, *findings)],
    }
    return made if verdict is None else {**made, "verdict": verdict.value}


def severity(verdict: Verdict) -> Severity:
    """How grave a verdict is; what is met is no more than information."""
    role = verdict.role()
    return "info" if role == "pass" else role


def document(
    *, title: str, subtitle: str, design: Mapping[str, Any], provenance: Mapping[str, Any],
    sections: Sequence[Section], kind: str = "report",
) -> Document:  # fmt: skip
    """Put a document together; its verdict counts every verdict in its sections.

    Numbers are rounded to the digits that are the same on every machine (`reports.certain`). Names of files
    and columns may hold anything: what cannot be seen in them is made visible.
    """
    made: Document = {
        "schema": SCHEMA, "version": VERSION, "kind": kind, "title": visible(title),
        "subtitle": visible(subtitle), "design": _seen(plain(design)), "provenance": _seen(plain(provenance)),
        "verdict": verdict_of(sections, kind), "sections": [_seen(certain(part)) for part in sections],
    }  # fmt: skip
    check(made)
    return made


def _seen(value: Any) -> Any:
    """Make every text of plain data visible, keys included."""
    if isinstance(value, str):
        return visible(value)
    if isinstance(value, dict):
        return {visible(key): _seen(item) for key, item in value.items()}
    return [_seen(item) for item in value] if isinstance(value, list | tuple) else value


def figures(made: Mapping[str, Any]) -> list[Block]:
    return [block for part in made["sections"] for block in walk(part) if block["kind"] == "figure"]


def dumps(made: Mapping[str, Any]) -> str:
    """Write a document as JSON, one section a line; the same document gives the same text."""
    head = {key: value for key, value in made.items() if key != "sections"}
    lines = ",\n".join(_compact(part) for part in made["sections"])
    return f'{_compact(head)[:-1]},"sections":[\n{lines}\n]}}\n'


def loads(content: str, origin: str = "report.json") -> Tree:
    """Read a document; an InputError if it is no JSON, of another schema or version, or malformed."""
    made = parse_json(content, origin)
    check(made, origin)
    return dict(made)


def load(path: str | Path) -> Tree:
    """Read a document from a file of somebody; see `loads`.

    Refused is also one whose verdict is not that of its sections, or of which a figure cannot be drawn.
    """
    made = read_json(path)
    check(made, shown_path(path))
    refuse_undrawable(figures(made), shown_path(path))
    counted = verdict_of(made["sections"], made["kind"])
    if made["verdict"] != counted:
        raise InputError("verdict: does not agree with the verdicts in its sections", where=shown_path(path))
    return dict(made)


def check(made: Any, origin: str | None = None) -> None:
    """Refuse a document that a page could not be made of: the place, and what is wrong with it."""
    validate(made, origin)
    for id, count in Counter(part["id"] for part in made["sections"]).items():
        if count > 1:
            raise InputError(f"section {shown(id)} occurs twice", where=origin)
