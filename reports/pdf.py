"""Reports as PDF for signing, typeset by typst from the same document as the page.

The template gets texts only: numbers in their format, figures as SVG, nothing that is markup.
"""

import json
import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.files.atomic import write_bytes
from actuator_lti.files.reading import Tree
from actuator_lti.start.extras import need
from reports.charts.svg import draw_all
from reports.document import column, figures, judged, section, shown_fact, table
from reports.html import KICKERS, show_signed
from reports.numbers import show
from reports.verdict_summary import role, verdict_lines, why
from reports.visible import LINE_END, visible

TEMPLATE = Path(__file__).resolve().parent / "templates" / "pdf" / "report.typ"
MAX_BYTES = 64_000_000
MAX_CELL = 600
MAX_TEXT = 20_000
MAX_TITLE = 240
LINE_PT = 481.0
HALF_PT = 232.0
SCALE = 0.54
_LONG_WORD = re.compile(r"\S{24,}")
_BREAKS = re.compile(r"[\t\n\r\f\v\x1c-\x1f\x85\u2028\u2029]+")
_SIZE = re.compile(r'<svg [^>]*viewBox="[-\d.]+ [-\d.]+ ([\d.]+) ([\d.]+)"')


def write_pdf(made: Mapping[str, Any], path: str | Path, *, whole: bool = True) -> Path:
    """Write a document as PDF: cover with verdicts and lines to sign, tables, vector figures, page numbers.

    Written whole or not at all; not ``whole``: the first screen and one line a section. An InputError where
    the file cannot be written or the document is too large, a NumericalError where typst refuses it (no text
    of a document should be able to make it).
    """
    write_bytes(path, pdf_bytes(made if whole else summary(made)))
    return Path(path)


def pdf_bytes(made: Mapping[str, Any]) -> bytes:
    """Give a report as PDF; see `write_pdf`.

    The fonts are those that come with typst and matplotlib, embedded; what they lack is taken from the
    system's.  The same document gives the same file wherever those are the same.
    """
    need("typst", "pdf", "a PDF")
    import matplotlib
    import typst

    data = json.dumps(printable(made), ensure_ascii=False, allow_nan=False)
    if len(data) > MAX_BYTES:
        raise InputError(f"report of {len(data)} bytes: at most {MAX_BYTES} can be typeset")
    try:
        typeset = typst.compile(
            str(TEMPLATE), root=str(TEMPLATE.parent), sys_inputs={"document": data}, timestamp=_time(made),
            font_paths=[str(Path(matplotlib.get_data_path()) / "fonts" / "ttf")], format="pdf",
        )  # fmt: skip
        return bytes(typeset)
    except typst.TypstError as error:
        raise NumericalError(f"typst refuses the report: {str(error).splitlines()[0]}") from error


def _time(made: Mapping[str, Any]) -> int:
    text = (made.get("provenance") or {}).get("time")
    try:
        return int(datetime.fromisoformat(str(text)).astimezone(UTC).timestamp())
    except (ValueError, OverflowError):
        return 0


def summary(made: Mapping[str, Any]) -> Tree:
    """A document with the first screen, what it found in one line a section, and where it comes from."""
    kept = [part for part in made["sections"] if part["id"] in ("answer", "provenance")]
    rows = []
    for part in (one for one in made["sections"] if one not in kept):
        role = part["status"] if part["status"] in ("fail", "warn") else ""  # green is said of verdicts only
        rows.append({"part": part["title"], "found": part.get("result") or "", "_status": role})
    columns = [column("part", "Section"), column("found", "Found")]
    found = table("What each section of the whole report says", columns, rows)
    return {**made, "sections": [*kept[:1], section("found", "Section by section", [found]), *kept[1:]]}


def printable(made: Mapping[str, Any]) -> Tree:
    """Turn a document into what ``report.typ`` reads; nothing in it is markup any more."""
    drawings = draw_all(figures(made), page=False)
    design, origin = made.get("design") or {}, made.get("provenance") or {}
    every = (block for part in made["sections"] for block in part["blocks"])  # not those of each variant
    own = (block for block in every if block.get("what", "requirements") == "requirements")
    rows = [
        ("Design", design.get("name")),
        ("Revision", design.get("revision") or "not stated"),
        ("Hash of the design", origin.get("design_hash")),
        ("Computed by", f"actuator-lti {origin.get('version') or ''}"),
        ("Commit", origin.get("commit")),
        ("Date", origin.get("time")),
    ]
    return {
        "kicker": KICKERS.get(made.get("kind", "report"), "Report"),
        "title": clean(made.get("title"), MAX_TITLE),
        "subtitle": clean(made.get("subtitle"), 1200),
        "overall": [[clean(words, 200), role] for words, role in verdict_lines(made["verdict"])],
        "facts": [[label, clean(value, 200)] for label, value in rows if value],
        "revision": clean(design.get("revision"), 60),
        "verdicts": [_verdict(item) for item in judged(own)],  # what is signed
        "sections": [_section(part, drawings) for part in made["sections"]],
    }


def clean(value: object, limit: int = MAX_CELL) -> str:
    """Text that can be seen and can be broken into lines; longer than ``limit`` it is cut.

    >>> clean("a\\u202eb"), clean(None), clean("abcdef", 4)
    ('a⟨U+202E⟩b', '', 'abc…')
    """
    text = _BREAKS.sub(" ", visible("" if value is None else str(value)))
    if len(text) > limit:
        text = text[: limit - 1] + "…"
    return _LONG_WORD.sub(lambda m: "\u200b".join(re.findall(r".{1,12}", m.group())), text)


def _verdict(item: Mapping[str, Any]) -> Tree:
    limit = f"{item.get('comparison') or ''} {show(item.get('limit'), 'short:6')}".strip()
    value, distance = show(item.get("value"), "sig:4"), show_signed(item.get("distance"))
    label, unit = clean(item.get("label"), 200), clean(item.get("unit"), 30)
    return {
        "state": role(item),
        "cells": [label, item["verdict"], value, clean(limit, 60), distance, unit],
        "id": clean(item.get("id"), 120),
        "reason": clean(why(item), 400),
        "source": clean(item.get("source"), 200),
    }


def _section(part: Mapping[str, Any], drawings: Mapping[int, str]) -> Tree:
    blocks: list[Tree] = []
    for block in part["blocks"]:
        printed = _block(block, drawings)
        if printed["kind"] != "figure" or block.get("layout", "wide") == "wide":
            blocks.append(printed)
        elif blocks and blocks[-1]["kind"] == "row" and len(blocks[-1]["figures"]) == 1:
            blocks[-1]["figures"].append(printed)
        else:
            blocks.append({"kind": "row", "figures": [printed]})
    return {
        "title": clean(part["title"], MAX_TITLE),
        "intro": clean(f"{part.get('result') or ''} {part.get('intro') or ''}".strip(), MAX_TEXT),
        "status": part["status"],
        "blocks": blocks,
    }


def _block(block: Mapping[str, Any], drawings: Mapping[int, str]) -> Tree:
    kind = block["kind"]
    if kind == "table":
        return _table(block)
    if kind == "figure":
        svg = drawings[id(block)]
        size = _SIZE.search(svg)
        most = LINE_PT if block.get("layout", "wide") == "wide" else HALF_PT
        width = min(most, SCALE * float(size[1])) if size else most
        texts = {"caption": clean(block["caption"], 2000), "alt": clean(block["alt"], 2000)}
        return {"kind": "figure", "svg": visible(svg), "width": width, **texts}
    if kind == "facts":
        values = [f"{clean(shown_fact(i), 300)} {clean(i['unit'], 30)}".strip() for i in block["items"]]
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
    rows = []
    for row in block["loops"]:
        own = [_cell(cell["value"], cell["format"]) for cell in row["figures"]]
        rows.append({"status": "", "cells": [_cell(row["loop"], "text"), *own]})
    weakest = block["weakest"]
    words = [f"Weakest point: {weakest['label']}, {weakest['words']}."] if weakest else []
    words += [f"{weakest['move']}."] if weakest and weakest.get("move") else []
    words += [said for key in ("believed", "linear") if (said := block.get(key))]
    words += [item["text"] for item in block["findings"]]
    note = clean(" ".join(words), 2000)
    return {"kind": "table", "caption": "Each loop", "note": note, "columns": columns, "rows": rows}


def _table(block: Mapping[str, Any]) -> Tree:
    columns: Sequence[Mapping[str, Any]] = block["columns"]
    heads = [
        {
            "label": LINE_END.sub("\\g<0>\u200b", clean(c["label"], 120)),
            "unit": clean(c["unit"], 30),
            "align": c["align"],
        }
        for c in columns
    ]
    rows = []
    for row in block["rows"]:
        cells = [_cell(row.get(c["key"]), c["format"]) for c in columns]
        rows.append({"status": row.get("_status") or "", "cells": cells})
    caption, note = clean(block["caption"], 1000), clean(block.get("note"), 2000)
    return {"kind": "table", "caption": caption, "note": note, "columns": heads, "rows": rows}


def _cell(value: Any, form: str) -> dict[str, str]:
    mark = value if isinstance(value, Mapping) else {"text": value}
    return {"text": clean(show(mark.get("text"), form)), "status": mark.get("status") or ""}
