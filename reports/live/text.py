"""The design file as text with places that a changed value goes to: the user's own where there is one."""

import re
from collections.abc import Sequence
from itertools import accumulate, takewhile

from actuator_lti.design import read_design_text, with_overrides
from actuator_lti.design.mistakes import lines_of
from actuator_lti.design.model import Design
from actuator_lti.design.writing import design_tree, overridden_text, write_design
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree, parse_toml

MARK = "@@changed@@"
Patch = tuple[int, int, str, str]
"""What a changed value replaces: the characters from, to; what stands before it, and behind."""

_STRING = r'"(?:[^"\\]|\\.)*"' + r"|'[^']*'"
_ENTRY = re.compile(r"(\s*[^=]+?\s*=\s*)(.*)", re.DOTALL)
_VALUE = re.compile(rf"(\bvalue\s*=\s*)({_STRING}|[^\s,}}#]+)")
_SOURCE = re.compile(rf"(\bsource\s*=\s*)({_STRING})")
_GRADE = re.compile(rf",\s*grade\s*=\s*(?:{_STRING})|^grade\s*=\s*(?:{_STRING})[ \t]*\n?", re.MULTILINE)
_PLAIN = re.compile(rf"({_STRING}|[^\s#]+)")


def patches(design: Design, keys: Sequence[Tree], source: str | None = None) -> tuple[str, list[Patch]]:
    """Give the text of a design, and for each key what its change replaces.

    In ``source``, the text that the design was read from, only the entries of changed keys are written anew.
    Without it, or where a key cannot be changed in it, all is written anew.
    """
    if source is not None:
        lines = lines_of(source, parse_toml(source, "design"))
        own = [_own(design, key, source, lines) for key in keys]
        if (found := [each for each in own if each is not None]) == own:
            return source, found
    text = write_design(design)
    return text, [_patch(text, overridden_text(design, key["path"], MARK)) for key in keys]


def _own(design: Design, key: Tree, text: str, lines: dict[str, int]) -> Patch | None:
    """The patch of a key in a text of the user; None where the changed text would not say the same."""
    path, known = key["path"], design.parameters.get(key["path"])
    place = _entry_of(path, text, lines)
    made = _added(path, text)
    if place is not None and known is not None:
        changed = _changed(text[slice(*place)], known.text)
        made = None if changed is None else (*place, *changed)
    if made is None:
        return None
    number = key["value"] / key["factor"]
    value = f"{number!r} {key['unit']}" if key["unit"] else int(number) if key["whole"] else number
    written = f'"{value}"' if isinstance(value, str) else repr(value)
    begin, end, before, after = made
    try:
        read = read_design_text(text[:begin] + before + written + after + text[end:], design.origin)
        wanted = with_overrides(design, {path: value})
    except InputError:
        return None
    return made if design_tree(read) == design_tree(wanted) else None


def _entry_of(path: str, text: str, lines: dict[str, int]) -> tuple[int, int] | None:
    """Where the entry of a key stands: its line, or the lines of its own table."""
    number = lines.get(path)
    if number is None:
        return None
    starts = list(accumulate(map(len, text.splitlines(keepends=True)), initial=0))
    last = max([number, *(line for key, line in lines.items() if key.startswith(f"{path}."))])
    return starts[number - 1], starts[last]


def _changed(entry: str, was: str) -> tuple[str, str] | None:
    """An entry with another value: what stands before it, and behind."""
    if _VALUE.search(entry):
        quoted = was.replace("\\", "\\\\").replace('"', '\\"')
        cut = _GRADE.sub("", entry, count=1)
        made = _SOURCE.sub(lambda found: f'{found[1]}"changed from {quoted}"', cut, count=1)
        made = _VALUE.sub(lambda found: found[1] + MARK, made, count=1)
    else:
        entered = _ENTRY.fullmatch(entry)
        if entered is None:
            return None
        made = entered[1] + _PLAIN.sub(MARK, entered[2], count=1)
    before, mark, after = made.partition(MARK)
    return (before, after) if mark else None


def _added(path: str, text: str) -> Patch | None:
    """An entry behind the header of its table, or with its whole path before all tables."""
    table, _, key = path.rpartition(".")
    if header := re.search(rf"^\[{re.escape(table)}\][^\n]*\n", text, re.MULTILINE):
        return header.end(), header.end(), f"{key} = ", "\n"
    first = re.search(r"^\[", text, re.MULTILINE)
    place = first.start() if first else len(text)
    return place, place, f"{path} = ", "\n"


def _alike(one: Sequence[str], other: Sequence[str]) -> int:
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(one, other, strict=False)))


def _patch(text: str, changed: str) -> Patch:
    """Give the lines in which two texts differ, the second cut at the mark."""
    old, new = text.splitlines(keepends=True), changed.splitlines(keepends=True)
    first = _alike(old, new)
    last = _alike(old[first:][::-1], new[first:][::-1])
    begin, end = sum(map(len, old[:first])), sum(map(len, old[: len(old) - last]))
    before, _, after = "".join(new[first : len(new) - last]).partition(f'"{MARK}"')
    return begin, end, before, after
