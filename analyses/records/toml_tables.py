"""Reading TOML strictly: unknown keys refused, every fault with key, value and what is allowed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from actuator_lti.design.units import parse_quantity
from actuator_lti.errors import InputError
from actuator_lti.reading import read_campaign_toml
from actuator_lti.tree import Tree


def read_toml(path: Path) -> Tree:
    """The file as a dictionary, or one line that says where it is broken."""
    return read_campaign_toml(path, "campaign or record file")


class Table:
    """One table of a file, read key by key; ``done`` refuses what was not asked for."""

    def __init__(self, data: object, path: str, origin: str) -> None:
        self.path, self.origin = path, origin
        if not isinstance(data, Mapping):
            raise InputError(f"{path}: must be a table", where=origin)
        self._data: Mapping[str, Any] = data
        self._asked: set[str] = set()

    def key(self, name: str) -> str:
        """The dotted path of a key."""
        return f"{self.path}.{name}" if self.path else name

    def fail(self, name: str, allowed: str) -> InputError:
        """The refusal of one key."""
        shown = repr(self._data.get(name))[:60] if name in self._data else "is missing"
        joint = " = " if name in self._data else " "
        return InputError(f"{self.key(name)}{joint}{shown}: {allowed}", where=self.origin)

    def __contains__(self, name: str) -> bool:
        return name in self._data

    def __iter__(self) -> Any:
        self._asked.update(self._data)
        return iter(self._data)

    def text(self, name: str, default: str | None = None, allowed: Sequence[str] = ()) -> str:
        """A text; missing without a default is refused."""
        value = self._get(name, default)
        if not isinstance(value, str) or (allowed and value not in allowed):
            raise self.fail(name, "one of " + ", ".join(allowed) if allowed else "a text is wanted")
        return value

    def column(self, name: str, default: str) -> str | int:
        """A column: its name, or its number from 1."""
        value = self._get(name, default)
        if isinstance(value, bool) or not isinstance(value, str | int):
            raise self.fail(name, "a column name, or a number from 1")
        return value

    def texts(self, name: str) -> tuple[str, ...]:
        """A list of texts; empty where it is not given."""
        self._asked.add(name)
        value = self._data.get(name, [])
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise self.fail(name, "a list of texts is wanted")
        return tuple(value)

    def integer(self, name: str, default: int) -> int:
        """A whole number."""
        value = self._get(name, default)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.fail(name, "a whole number is wanted")
        return value

    def flag(self, name: str, default: bool | None) -> bool | None:
        """True or false."""
        value = self._data.get(name, default)
        self._asked.add(name)
        if value is not None and not isinstance(value, bool):
            raise self.fail(name, "true or false")
        return value

    def number(self, name: str, default: float | None = None) -> float | None:
        """A bare number, or None where it is not given."""
        value = self._data.get(name, default)
        self._asked.add(name)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e300:
            raise self.fail(name, "a number is wanted")
        return float(value)

    def quantity(self, name: str, unit: str, default: float | None = None) -> float | None:
        """A number with a unit, in SI; None or the default where it is not given."""
        self._asked.add(name)
        if name not in self._data:
            return default
        value = self._data[name]
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise self.fail(name, f"a quantity in {unit or 'no unit'}")
        try:
            return parse_quantity(value, unit)
        except InputError as error:
            raise self.fail(name, error.message) from None

    def table(self, name: str) -> Table:
        """A table below this one; empty where it is not given."""
        self._asked.add(name)
        return Table(self._data.get(name, {}), self.key(name), self.origin)

    def tables(self, name: str) -> list[Table]:
        """An array of tables."""
        self._asked.add(name)
        value = self._data.get(name, [])
        if not isinstance(value, list):
            raise self.fail(name, f"an array of tables, [[{name}]]")
        return [Table(item, f"{self.key(name)}[{k}]", self.origin) for k, item in enumerate(value, 1)]

    def done(self) -> None:
        """Refuse keys that nothing asked for."""
        for name in self._data:
            if name not in self._asked:
                near = get_close_matches(name, self._asked, 1)
                hint = f'; did you mean "{near[0]}"?' if near else ""
                raise InputError(f"{self.key(name)}: unknown key{hint}", where=self.origin)

    def _get(self, name: str, default: Any) -> Any:
        self._asked.add(name)
        if name in self._data:
            return self._data[name]
        if default is None:
            raise self.fail(name, "it is needed")
        return default
