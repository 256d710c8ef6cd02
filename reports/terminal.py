"""Blocks of a document as tables on a terminal."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from actuator_lti.asked.verdict import Verdict
from reports import document as doc
from reports.certain import certain
from reports.cli.output import console, printable
from reports.document_schema import GOES_ON
from reports.numbers import prose, show, show_signed
from reports.verdict_summary import judged, role, tally, walk, worded

COLOURS = {"pass": "green", "fail": "bold red", "warn": "yellow", "info": "dim"}
WRAPPED = 26  # characters; a cell of text is not broken into narrower lines
VERDICT_WRAPPED = 18
CONTINUED = ", continued"  # of a table whose columns take several
SIGNS = {"pass": "✓", "fail": "✗", "warn": "?", "info": "–"}
HEADS = {"met": "PASS", "not met": "FAIL", "not proven": "NOT PROVEN"}


@dataclass(frozen=True)
class Brief:
    """What the terminal prints of an analysis whose sections are too long for it."""

    words: str
    blocks: Sequence[Mapping[str, Any]]
    notes: Sequence[str] = ()


def print_blocks(blocks: Sequence[Mapping[str, Any]], notes: Sequence[str] = ()) -> None:
    out = console()
    for block in blocks:
        _print(certain(block), out)
    for note in dict.fromkeys(notes):
        out.print(Text(f"note: {note}", style="yellow"))


def print_verdict(passed: bool | Verdict, words: str, but: str = "") -> None:
    verdict = Verdict.of(passed)
    line = Text().append(HEADS[verdict] + but, style=COLOURS[verdict.role()])
    console().print(line.append(f"  {printable(prose(words))}"), soft_wrap=True)


def print_section(section: Mapping[str, Any], passed: bool | Verdict | None, name: str = "") -> None:
    """Print a section: verdict or result first (of ``name``), then how it was found, then its tables."""
    words = f"{name}: {section['result']}" if name else section["result"]
    if passed is None:
        console().print(Text(printable(words)), soft_wrap=True)
    else:
        open_ones = tally(judged(walk(section))).not_proven if Verdict.of(passed) is Verdict.MET else 0
        print_verdict(passed, words, f", {open_ones} not proven" if open_ones else "")
    if section["intro"]:
        console().print(Text(section["intro"], style="dim"))
    print_blocks(section["blocks"])


def _print(block: Mapping[str, Any], out: Console) -> None:
    wrapped = WRAPPED
    if block["kind"] == "verdicts":
        block, wrapped = verdict_table(block), VERDICT_WRAPPED
    if block["kind"] == "table":
        for part in _parts(block, wrapped, out):
            out.print(part)
        if block.get("note"):
            out.print(Text(block["note"], style="dim"))
    elif block["kind"] == "facts":
        facts = Table.grid(padding=(0, 2))
        for item in block["items"]:
            facts.add_row(Text(item["label"]), Text(f"{doc.shown_fact(item)} {item['unit']}".rstrip()))
        out.print(facts)
    elif block["kind"] == "text":
        out.print(Text(block["text"]))
    elif block["kind"] == "details":
        for inner in block["blocks"]:
            _print(inner, out)


def _parts(block: Mapping[str, Any], wrapped: int, out: Console) -> Iterator[Table | Text]:
    """The table where it fits; else what is behind its ``heads`` in two parts, each likewise; or stacked."""
    laid, heads = _laid(block, wrapped, out), block.get("heads", 0)
    first, others = block["columns"][:heads], block["columns"][heads:]
    if _fits(laid, out):
        yield laid
    elif not heads or len(others) < 2:
        yield stacked(block)
    else:
        middle, caption = -(-len(others) // 2), f"{block['caption'].removesuffix(CONTINUED)}{CONTINUED}"
        yield from _parts({**block, "columns": [*first, *others[:middle]]}, wrapped, out)
        yield from _parts({**block, "columns": [*first, *others[middle:]], "caption": caption}, wrapped, out)


def _laid(block: Mapping[str, Any], wrapped: int, out: Console) -> Table:
    if block.get("turned"):
        first, *others = block["columns"]
        made = _empty(block["caption"])
        made.add_column("")
        for row in block["rows"]:
            made.add_column(_cell(row[first["key"]], first["format"]), justify="right")
        for column in others:
            cells = (_cell(row.get(column["key"], ""), column["format"]) for row in block["rows"])
            made.add_row(Text(_label(column)), *cells)
        return made
    laid = table(block, wrapped)
    if Measurement.get(out, out.options.update(width=10_000), laid).maximum > out.width:
        laid = table(block, wrapped, narrow=True)
    return laid if _fits(laid, out) else table(block, VERDICT_WRAPPED, narrow=True)


def table(block: Mapping[str, Any], wrapped: int, *, narrow: bool = False) -> Table:
    """Lay a table block out; ``narrow``: each word of a heading longer than its column on its own line."""
    made = _empty(block["caption"])
    for column in block["columns"]:
        unit = f"[{column['unit']}]" if column["unit"] else ""
        label = " ".join(filter(None, (column["label"], unit)))
        cells = [_cell(row.get(column["key"]), column["format"]) for row in block["rows"]]
        longest = max((cell.cell_len for cell in cells), default=0)
        least = longest if column["align"] == "right" else min(longest, wrapped)
        words = " ".join([label, *(cell.plain for cell in cells)]).split()
        least = max(least, *map(len, words))  # no word is cut: a key, a file's name
        label = label.replace(" ", "\n") if narrow and len(label) > least else label
        made.add_column(Text(label), justify=column["align"], min_width=least, no_wrap=least >= longest)
    for row in block["rows"]:
        made.add_row(*(_cell(row.get(column["key"]), column["format"]) for column in block["columns"]))
    return made


def _fits(laid: Table, out: Console) -> bool:
    """Whether no word is wider than its column, nor the table, laid out, than the terminal."""
    least = Measurement.get(out, out.options.update(width=10_000), laid).minimum
    lines = Segment.split_lines(out.render(laid))
    return max(least, *map(Segment.get_line_length, lines)) <= out.width


def stacked(block: Mapping[str, Any]) -> Text:
    """Write a table as one paragraph a row: the first cell, then the others, each by its label."""
    first, *others = block["columns"]
    text = Text().append(block["caption"], style="bold")
    for row in block["rows"]:
        text.append("\n").append_text(_cell(row.get(first["key"]), first["format"])).append(": ")
        _list(text, ((column, row.get(column["key"])) for column in others))
    return text.append("\n")


def _list(text: Text, said: Iterable[tuple[Mapping[str, Any], Any]]) -> None:
    cells = [(column, _cell(value, column["format"])) for column, value in said]
    there = [(column, cell) for column, cell in cells if cell.plain.strip() not in ("", "–")]
    for number, (column, cell) in enumerate(there):
        label = column["label"] if column["label"] != "Unit" else ""
        between = " " if column["label"] == "Unit" else ", " if label in GOES_ON else "; "
        text.append(between if number else "")
        text.append(f"{label} ".lstrip()).append_text(cell).append(f" {column['unit']}".rstrip())


def side_by_side(title: str, blocks: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Tables of the same rows as one, printed turned where there is room: a line a figure, a column a row."""
    head, columns, rows = blocks[0]["columns"][0], list[doc.Column](), dict[str, dict[str, Any]]()
    for block in blocks:
        first, *others = block["columns"]
        columns += others
        for row in block["rows"]:
            one = rows.setdefault(row[first["key"]], {head["key"]: row[first["key"]]})
            one |= {column["key"]: row.get(column["key"]) for column in others}
    return {**doc.table(title, [head, *columns], rows.values()), "turned": True}


def _label(column: Mapping[str, Any]) -> str:
    """Write a column's label and unit in one line; a continuation is set back."""
    name = column["label"] if column["label"] not in GOES_ON else f"  {column['label']}".rstrip() or " "
    return f"{name}, {column['unit']}" if column["unit"] and name.strip() else f"{name} {column['unit']}"


def verdict_table(block: Mapping[str, Any]) -> Mapping[str, Any]:
    columns = [doc.column("label", "Requirement"), doc.column("word", "Verdict")]
    columns += [doc.column(key, key.capitalize(), align="right") for key in ("found", "limit", "distance")]
    rows = []
    for item in block["items"]:
        colour = role(item)
        word = {"text": f"{SIGNS[colour]} {worded(item)}", "status": colour}
        limit = f"{item['comparison']} {show(item['limit'])}"
        found, distance = show(item["value"]), show_signed(item["distance"])
        rows.append((item["label"], word, found, limit, distance, item["unit"]))
    caption = block.get("what", "requirements").capitalize()
    return doc.table(caption, [*columns, doc.column("unit", "Unit")], rows)


def _empty(caption: str) -> Table:
    look: dict[str, Any] = {"title_justify": "left", "title_style": "bold", "box": SIMPLE_HEAD}
    return Table(title=Text(caption), **look, pad_edge=False, padding=(0, 1))


def _cell(value: Any, format: str) -> Text:
    if isinstance(value, Mapping):
        return Text(show(value["text"], format), style=COLOURS.get(value.get("status") or "", ""))
    return Text(show(value, format))
