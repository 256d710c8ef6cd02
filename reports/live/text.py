"""The design file as text with places that a changed value goes to: the user's own where there is one."""

import pickle
import re
from collections.abc import Sequence
from contextlib import suppress
from difflib import SequenceMatcher
from functools import cache
from itertools import pairwise

import tomlkit

from actuator_lti.design import design_hash, read_design_text
from actuator_lti.design.model import Design
from actuator_lti.design.writing import design_tree, override, write_design
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree

MARK = "@@changed@@"
# Texts of several lines: no heads stand in them.
_LINES = re.compile(r'"""(?:\\.|.)*?"""|\'\'\'.*?\'\'\'', re.S)
Patch = tuple[int, int, str, str]
"""What a changed value replaces: the characters from, to; what stands before it, and behind."""


def patches(design: Design, keys: Sequence[Tree], source: str | None = None) -> tuple[str, list[Patch]]:
    """Give the text of a design, and for each key what its change replaces.

    In ``source``, the text that the design was read from, only the entries of changed keys are written anew.
    Without it, or where the changed text would not say the same, all is written anew.
    """
    with suppress(InputError, tomlkit.exceptions.TOMLKitError):
        if source is not None and design_tree(read_design_text(source, design.origin)) == design_tree(design):
            found = _patches(design, keys, source)
            again = read_design_text(_written_anew(source, keys, found), design.origin)
            if design_hash(again) == design_hash(design):
                return source, found
    text = write_design(design)
    return text, _patches(design, keys, text)


def _written_anew(text: str, keys: Sequence[Tree], places: Sequence[Patch]) -> str:
    """The text with the value that each key has, written as a change of it would be."""
    made, last = "", 0
    for (begin, end, before, after), key in sorted(
        zip(places, keys, strict=True), key=lambda one: one[0][:2]
    ):
        number = key["value"] / key["factor"]
        value = f'"{number!r} {key["unit"]}"' if key["unit"] else int(number) if key["whole"] else number
        made, last = f"{made}{text[last:begin]}{before}{value}{after}", end
    return made + text[last:]


def _patches(design: Design, keys: Sequence[Tree], text: str) -> list[Patch]:
    bare = _LINES.sub(lambda lines: " " * len(lines[0]), text)
    tables, parsed = _tables(bare), cache(lambda part: pickle.dumps(tomlkit.parse(part)))
    places = [(key["path"], *tables.get(key["path"].split(".")[0], (0, len(text)))) for key in keys]
    # each key changes a copy, of its own tables alone
    return [
        _patch(design, path, text[start:stop], start, bare, pickle.loads(parsed(text[start:stop])))
        for path, start, stop in places
    ]


def _tables(bare: str) -> dict[str, tuple[int, int]]:
    """From where to where the tables of each first name stand, unless entries stand before all of them."""
    heads = [(head[1], head.start()) for head in re.finditer(r"(?m)^\[\[?\s*([A-Za-z][\w-]*)", bare)]
    found: dict[str, tuple[int, int]] = {}
    if re.search(r"(?m)^[^#\n]*=", bare[: heads[0][1]] if heads else bare):
        return found
    for (name, start), (_, stop) in pairwise([*heads, ("", len(bare))]):
        found[name] = (found.get(name, (start,))[0], stop)
    return found


def _patch(design: Design, path: str, part: str, start: int, bare: str, tree: tomlkit.TOMLDocument) -> Patch:
    """Give the lines in which a part differs from that with a key changed, the latter cut at the value.

    ``bare``: the whole text, in which heads are looked for.
    """
    override(tree, path, MARK, design)
    old, new = (each.splitlines(keepends=True) for each in (part, tomlkit.dumps(tree)))
    edits = [one for one in SequenceMatcher(None, old, new, False).get_opcodes() if one[0] != "equal"]
    (_, first, _, begins, _), (_, _, last, _, ends) = edits[0], edits[-1]
    begin, end = (start + sum(map(len, old[:line])) for line in (first, last))
    before, _, after = "".join(new[begins:ends]).partition(f'"{MARK}"')
    table, _, key = path.rpartition(".")
    if begin == end and (head := re.search(rf"(?m)^\[{re.escape(table)}\].*\n", bare)):  # a key that is new
        return head.end(), head.end(), f"{key} = ", "\n"
    if begin == end and "[" in before:  # in a table that is not there: with its whole path before all others
        begin = end = len(re.split(r"(?m)^\[", bare)[0])
        before = f"{path} = "
    return begin, end, before, after
