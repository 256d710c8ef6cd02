"""A document as the template prints it: texts only, numbers in their format, figures as SVG."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from actuator_lti.files.tree import Tree
from reports.document import column, figures, section, table, walk
from reports.drawing import draw_all
from reports.html import KICKERS, show_signed
from reports.numbers import show
from reports.verdict_summary import role, verdict_lines, why
from reports.visible import visible

MAX_CELL = 600
MAX_TEXT = 20_000
MAX_TITLE = 240
LINE_PT = 481.0
HALF_PT = 232.0
SCALE = 0.54
_LONG_WORD = re.compile(r"\S{24,}")
_BREAKS = re.compile(r"[\t\n\r\f\v\x1c-\x1f\x85\u2028\u2029]+")
_SIZE = re.compile(r'<svg [^>]*viewBox="[-\d.]+ [-\d.]+ ([\d.]+) ([\d.]+)"')


def summary(made: Mapping[str, Any]) -> Tree:
    """A document with the first screen, what it found in one line a section, and where it comes from."""
    kept = [part for part in made["sections"] if part["id"] in ("answer", "provenance")]
    columns = [column("part", "Section"), column("found", "Found")]
    rows = [
        {"part": part["title"], "found": part.get("result") or "", "_status": part["status"]}
        for part in made["sections"]
        if part not in kept
    ]
    for row in rows:  # green is said of verdicts only
        row["_status"] = row["_status"] if row["_status"] in ("fail", "warn") else ""
    found = section(
        "found", "Section by section", [table("What each section of the whole report says", columns, rows)]
    )
    return {**made, "sections": [*kept[:1], found, *kept[1:]]}


def printable(made: Mapping[str, Any]) -> Tree:
    """Turn a document into what ``report.typ`` reads; nothing in it is markup any more."""
    blocks = figures(made)
    drawings = dict(zip(map(id, blocks), draw_all(blocks, page=False), strict=True))
    design, origin = made.get("design") or {}, made.get("provenance") or {}
    return {
        "kicker": KICKERS.get(made.get("kind", "report"), "Report"),
        "title": clean(made.get("title"), MAX_TITLE),
        "subtitle": clean(made.get("subtitle"), 1200),
        "overall": [[clean(words, 200), status] for words, status in verdict_lines(made["verdict"])],
        "facts": _facts(design, origin),
        "revision": clean(design.get("revision"), 60),
        "verdicts": [_verdict(item) for item in _required(made)],
        "sections": [_section(part, drawings) for part in made["sections"]],
    }


def clean(value: object, limit: int = MAX_CELL) -> str:
    """Text that can be seen and can be broken into lines; longer than ``limit`` it is cut.

    Examples
    --------
    >>> clean("a\\u202eb"), clean(None), clean("abcdef", 4)
    ('a⟨U+202E⟩b', '', 'abc…')
    """
    text = _BREAKS.sub(" ", visible("" if value is None else str(value)))
    if len(text) > limit:
        text = text[: limit - 1] + "…"
    return _LONG_WORD.sub(lambda m: "\u200b".join(re.findall(r".{1,12}", m.group())), text)


def _facts(design: Mapping[str, Any], origin: Mapping[str, Any]) -> list[list[str]]:
    rows = [
        ("Design", design.get("name")),
        ("Revision", design.get("revision") or "not stated"),
        ("Hash of the design", origin.get("design_hash")),
        ("Computed by", f"actuator-lti {origin.get('version') or ''}"),
        ("Commit", origin.get("commit")),
        ("Date", origin.get("time")),
    ]
    return [[label, clean(value, 200)] for label, value in rows if value]


def _required(made: Mapping[str, Any]) -> Iterable[Mapping[str, Any]]:
    """Give the verdicts on the design's own requirements: what is signed."""
    for part in made["sections"]:
        for block in walk(part):
            if block["kind"] == "verdicts" and block.get("what", "requirements") == "requirements":
                yield from block["items"]


def _verdict(item: Mapping[str, Any]) -> Tree:
    limit = f"{item.get('comparison') or ''} {show(item.get('limit'), 'short:6')}".strip()
    return {
        "state": role(item),
        "cells": [
            clean(item.get("label"), 200),
            item["verdict"],
            show(item.get("value"), "sig:4"),
            clean(limit, 60),
            show_signed(item.get("distance")),
            clean(item.get("unit"), 30),
        ],
        "id": clean(item.get("id"), 120),
        "reason": clean(why(item), 400),
        "source": clean(item.get("source"), 200),
    }


def _section(part: Mapping[str, Any], drawings: Mapping[int, str]) -> Tree:
    return {
        "title": clean(part["title"], MAX_TITLE),
        "intro": clean(f"{part.get('result') or ''} {part.get('intro') or ''}".strip(), MAX_TEXT),
        "status": part["status"],
        "blocks": _paired([(_block(block, drawings), block) for block in part["blocks"]]),
    }


def _paired(made: Sequence[tuple[Tree, Mapping[str, Any]]]) -> list[Tree]:
    """Put half-wide figures that follow each other in pairs beside each other."""
    blocks: list[Tree] = []
    for printed, block in made:
        if printed["kind"] != "figure" or block.get("layout", "wide") == "wide":
            blocks.append(printed)
        elif blocks and blocks[-1]["kind"] == "row" and len(blocks[-1]["figures"]) == 1:
            blocks[-1]["figures"].append(printed)
        else:
            blocks.append({"kind": "row", "figures": [printed]})
    return blocks


def _block(block: Mapping[str, Any], drawings: Mapping[int, str]) -> Tree:
    kind = block["kind"]
    if kind == "table":
        return _table(block)
    if kind == "figure":
        return _figure(block, drawings[id(block)])
    if kind == "facts":
        values = [f"{clean(show(i['value']), 300)} {clean(i['unit'], 30)}".strip() for i in block["items"]]
        labels = [clean(i["label"], 200) for i in block["items"]]
        return {"kind": kind, "items": [list(pair) for pair in zip(labels, values, strict=True)]}
    if kind == "verdicts":
        return {"kind": kind, "items": [_verdict(item) for item in block["items"]]}
    if kind == "glance":
        return _glance(block)
    if kind == "details":
        inner = [_block(b, drawings) for b in block["blocks"]]
        return {"kind": kind, "title": clean(block["title"], MAX_TITLE), "blocks": inner}
    return {"kind": "text", "paragraphs": [clean(p, MAX_TEXT) for p in str(block["text"]).split("\n\n")]}


def _glance(block: Mapping[str, Any]) -> Tree:
    """Print the first screen as the table of its loops, with the weakest point and the findings as note."""
    cells = block["loops"][0]["figures"] if block["loops"] else []
    columns = [{"label": "Loop", "unit": "", "align": "left"}]
    columns += [{"label": cell["label"], "unit": cell["unit"], "align": "right"} for cell in cells]
    rows = [
        {
            "status": "",
            "cells": [_cell(row["loop"], "text"), *(_cell(c["value"], c["format"]) for c in row["figures"])],
        }
        for row in block["loops"]
    ]
    weakest = block["weakest"]
    words = [f"Weakest point: {weakest['label']}, {weakest['words']}."] if weakest else []
    words += [f"{weakest['move']}."] if weakest and weakest.get("move") else []
    words += [said for key in ("believed", "linear") if (said := block.get(key))]
    words += [item["text"] for item in block["findings"]]
    note = clean(" ".join(words), 2000)
    return {"kind": "table", "caption": "Each loop", "note": note, "columns": columns, "rows": rows}


def _figure(block: Mapping[str, Any], svg: str) -> Tree:
    """Scale every figure alike, so that their lettering is the same; half-wide ones stand in pairs."""
    size = _SIZE.search(svg)
    most = LINE_PT if block.get("layout", "wide") == "wide" else HALF_PT
    width = min(most, SCALE * float(size[1])) if size else most
    texts = {"caption": clean(block["caption"], 2000), "alt": clean(block["alt"], 2000)}
    return {"kind": "figure", "svg": visible(svg), "width": width, **texts}


def _table(block: Mapping[str, Any]) -> Tree:
    columns: Sequence[Mapping[str, Any]] = block["columns"]
    return {
        "kind": "table",
        "caption": clean(block["caption"], 1000),
        "note": clean(block.get("note"), 2000),
        "columns": [
            {"label": clean(c["label"], 120), "unit": clean(c["unit"], 30), "align": c["align"]}
            for c in columns
        ],
        "rows": [
            {
                "status": row.get("_status") or "",
                "cells": [_cell(row.get(c["key"]), c["format"]) for c in columns],
            }
            for row in block["rows"]
        ],
    }


def _cell(value: Any, form: str) -> dict[str, str]:
    if isinstance(value, Mapping):
        return {"text": clean(show(value.get("text"), form)), "status": value.get("status") or ""}
    return {"text": clean(show(value, form)), "status": ""}
