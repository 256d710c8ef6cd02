"""All mistakes of a design file at once, each with its line; past what is `UNREAD` all is checked."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from actuator_lti.errors import InputError, as_one
from actuator_lti.files.reading import Tree, shown

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

T = TypeVar("T")
MOST = 30  # told at once
_KEY = r"(?:[\w-]+|\"[^\"]*\"|'[^']*')"
_HEADER = re.compile(rf"\s*(\[\[?)\s*({_KEY}(?:\s*\.\s*{_KEY})*)\s*\]")
_ENTRY = re.compile(rf"\s*({_KEY}(?:\s*\.\s*{_KEY})*)\s*=")
_PARTS = re.compile(_KEY)

Refusal = tuple[str, object, str]  # key, value as it is to be shown ("" for none), and what is allowed
Check = Callable[["Design"], Iterator[Refusal]]


def refusal_text(refusal: Refusal) -> str:
    """``key = value: what is allowed``."""
    path, given, reason = refusal
    unread = given is UNREAD or (isinstance(given, tuple) and any(each is UNREAD for each in given))
    value = "" if unread else f"{given}"
    return f"{shown(path, 200)[1:-1]}{f' = {value}' if value else ''}: {reason}"


def printed(value: object) -> str:
    """A value as `Refusal` has it: quoted and short, nothing of one that could not be read."""
    return "" if value is UNREAD else shown(value)


class UnreadError(Exception):
    """Something was to be decided by a value that could not be read."""


class _Unread:
    """There, but not known: sums and products with it are unread too; who decides by it or shows it stops."""

    def _passed_on(self, *_: object) -> _Unread:
        return self

    def _asked(self, *_: object) -> Any:
        raise UnreadError

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _passed_on
    __mod__ = __rmod__ = __pow__ = __rpow__ = __neg__ = __abs__ = _passed_on
    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = __bool__ = __hash__ = __format__ = _asked
    __float__ = __int__ = __index__ = __len__ = __iter__ = __getitem__ = __contains__ = _asked

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name) if name.startswith("__") else UnreadError


UNREAD: Any = _Unread()


def readable(items: Iterable[T]) -> Iterator[T]:
    """The items up to the one that asks for a value that could not be read.

    >>> list(readable(x for x in (1, 2 * UNREAD, 3) if x > 0))
    [1]
    """
    try:
        yield from items
    except UnreadError:
        return


class Findings:
    """What is wrong in one file: its lines by dotted key, and the folder in which what it names lies."""

    def __init__(self, where: str, lines: Mapping[str, int] | None = None, folder: Path = Path()) -> None:
        self.where, self.folder = where, folder
        self.lines = dict(lines or {})
        self.found: list[tuple[int, InputError]] = []

    def note(self, path: str, given: object, reason: str) -> None:
        line = self._line(path)
        at = f"line {line}: " if line else ""
        text = f"{at}{refusal_text((path, given, reason))}"
        self.found.append((line, InputError(text, where=self.where)))

    def alias(self, path: str, written: str) -> None:
        """A key stands under another name: its mistakes are in that line."""
        self.lines[path] = self._line(written)

    def extend(self, refusals: Iterable[Refusal]) -> None:
        for refusal in refusals:
            self.note(*refusal)

    def refuse(self, refusals: Iterable[Refusal] = ()) -> None:
        """Refuse the file if there is any, or something was found before: all in its order."""
        self.extend(refusals)
        errors = [error for _, error in sorted(self.found, key=lambda item: item[0])]
        if len(errors) > MOST:
            errors[MOST:] = [InputError(f"and {len(errors) - MOST} more mistakes", where=self.where)]
        if errors:
            raise as_one(errors)

    def _line(self, path: str) -> int:
        while path and path not in self.lines:
            path = path.rpartition("[" if path.endswith("]") else ".")[0]
        return self.lines.get(path, 0)


def meant_of(word: str, known: Iterable[str], similarity: float = 0.65) -> str:
    every = list(known)
    return word if word in every else next(iter(get_close_matches(word, every, 1, similarity)), "")


def nearest(word: str, known: Iterable[str]) -> str:
    """`` (nearest known: "x")``, or nothing where none is near."""
    near = meant_of(word, known)
    return f' (nearest known: "{near}")' if near else ""


def lines_of(text: str, tree: Tree) -> dict[str, int]:
    """The line of each table and key of a TOML text, by its dotted path.

    A repeated table stands by its name or id, by its number and as ``gear[1]``.

    >>> text = '[[gear]]\\nname = "worm"\\nratio = 3'
    >>> lines_of(text, {"gear": [{"name": "worm", "ratio": 3}]})["gear.worm.ratio"]
    3
    """
    lines: dict[str, int] = {}
    counts = Counter[tuple[str, ...]]()
    tables: tuple[str, ...] = ("",)
    for number, line in _outside_texts(text):
        if header := _HEADER.match(line):
            names = _names(header[2])
            counts[names] += header[1] == "[["
            tables = _paths(names, tree, counts)
            for path in tables:
                lines[path] = number
            lines.setdefault(".".join(names), number)
        elif entry := _ENTRY.match(line):
            names = _names(entry[1])
            for table in tables:
                for depth in range(1, len(names) + 1):
                    lines.setdefault(".".join(filter(None, (table, *names[:depth]))), number)
    return lines


def _names(dotted: str) -> tuple[str, ...]:
    return tuple(name[1:-1] if name[0] in "\"'" else name for name in _PARTS.findall(dotted))


def _outside_texts(text: str) -> Iterator[tuple[int, str]]:
    """Numbered lines that do not begin inside a text of several lines."""
    inside = ""
    for number, line in enumerate(text.splitlines(), 1):
        if not inside:
            yield number, line
        for mark in re.findall(r'"""|' + "'''", line):
            inside = "" if inside == mark else inside or mark


def _paths(names: tuple[str, ...], tree: Any, counts: Counter[tuple[str, ...]]) -> tuple[str, ...]:
    """The spellings of a table's path, with the label of each repeated table on the way."""
    spelled: tuple[str, ...] = ("",)
    for depth, name in enumerate(names, 1):
        tree = tree.get(name) if isinstance(tree, dict) else None
        labels = [name]
        if isinstance(tree, list):
            count = counts[names[:depth]]
            tree = tree[count - 1] if 0 < count <= len(tree) else None
            known = [tree.get(key) for key in ("name", "id", "requirement")] if isinstance(tree, dict) else []
            label = next((one for one in known if isinstance(one, str)), count)
            labels = [f"{name}.{label}", f"{name}.{count}", f"{name}[{count}]"]
        spelled = tuple(f"{begin}.{label}" for begin in spelled for label in labels)
    return tuple(path[1:] for path in spelled)
