"""Tables of TOML as dataclasses: a key is a field by its name without the unit, and no other key is taken.

The type of a field says what is read: `WANTED`, one of some (``Literal``), a list of texts or, ``Annotated``
with its unit, a quantity. One without a default has to be given.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from actuator_lti.design.units import parse_quantity
from actuator_lti.errors import InputError
from analyses.request import key_of

T = TypeVar("T")
WANTED: Mapping[frozenset[type], str] = {
    frozenset({str}): "a text is wanted",
    frozenset({Path}): "a text is wanted",
    frozenset({bool}): "true or false",
    frozenset({int}): "a whole number is wanted",
    frozenset({float}): "a number is wanted",
    frozenset({str, int}): "a column name, or a number from 1",
}


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind, include_extras=True)


@dataclass(frozen=True)
class Table:
    """One table of a file, by its dotted path."""

    data: Mapping[str, Any]
    path: str
    origin: str

    def __post_init__(self) -> None:
        if not isinstance(self.data, Mapping):
            raise InputError(f"{self.path}: must be a table", where=self.origin)

    def __iter__(self) -> Iterator[str]:
        return iter(self.data)

    def key(self, name: str) -> str:
        """The dotted path of a key."""
        return f"{self.path}.{name}" if self.path else name

    def fail(self, name: str, allowed: str) -> InputError:
        """The refusal of one key."""
        value = f" = {self.data[name]!r:.60}" if name in self.data else " is missing"
        return InputError(f"{self.key(name)}{value}: {allowed}", where=self.origin)

    def table(self, name: str) -> Table:
        """A table below this one; empty where it is not given."""
        return Table(self.data.get(name, {}), self.key(name), self.origin)

    def tables(self, name: str) -> list[Table]:
        """An array of tables."""
        value = self.data.get(name, [])
        if not isinstance(value, list):
            raise self.fail(name, f"an array of tables, [[{name}]]")
        return [Table(item, f"{self.key(name)}[{k}]", self.origin) for k, item in enumerate(value, 1)]

    def only(self, known: Collection[str]) -> None:
        """Refuse keys that are not known."""
        for name in self.data:
            if name not in known:
                near = get_close_matches(name, known, 1)
                hint = f'; did you mean "{near[0]}"? Allowed: ' if near else "; allowed: "
                words = f"{self.key(name)}: unknown key{hint}{', '.join(sorted(known))}"
                raise InputError(words, where=self.origin)

    def read(self, kind: type[T], *, beside: Collection[str] = (), **given: Any) -> T:
        """A dataclass; ``beside``: keys for others to read, ``given``: fields that are no keys."""
        hints = _hints(kind)  # type: ignore[arg-type]
        own = [field for field in fields(kind) if field.name not in given]  # type: ignore[arg-type]
        self.only({*map(key_of, (field.name for field in own)), *beside})
        for field in own:
            if key_of(field.name) in self.data:
                given[field.name] = self._value(key_of(field.name), hints[field.name])
            elif field.default is MISSING and field.default_factory is MISSING:
                raise self.fail(key_of(field.name), "it is needed")
        return kind(**given)

    def _value(self, name: str, kind: Any) -> Any:
        """The value of a key, as the type of its field wants it."""
        value = self.data[name]
        if get_origin(kind) is Annotated:
            return self.quantity(name, get_args(kind)[1])
        if get_origin(kind) is Literal:
            if value not in get_args(kind):
                raise self.fail(name, "one of " + ", ".join(get_args(kind)))
            return value
        if get_origin(kind) is tuple:
            if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
                raise self.fail(name, "a list of texts is wanted")
            return tuple(value)
        kinds = frozenset(one for one in get_args(kind) or (kind,) if one is not NoneType)
        number = kinds == {float}
        taken = {int, float} if number else {str if one is Path else one for one in kinds}
        if type(value) not in taken or (number and not abs(value) < 1e300):
            raise self.fail(name, WANTED[kinds])
        return float(value) if number else Path(value) if kinds == {Path} else value

    def quantity(self, name: str, unit: str) -> float:
        """A number with a unit, in SI."""
        value = self.data.get(name)
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise self.fail(name, f"a quantity in {unit or 'no unit'}")
        try:
            return parse_quantity(value, unit)
        except InputError as error:
            raise self.fail(name, error.message) from None
