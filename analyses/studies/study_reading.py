"""Typed access to the tables of a study file, refusing with the place and what is allowed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from actuator_lti.errors import InputError
from actuator_lti.files.reading import read_toml, shown
from actuator_lti.files.tree import Tree

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

T = TypeVar("T")


@dataclass(frozen=True)
class Reader:
    """Reads the tables of one file.

    Attributes
    ----------
    where : str
        The file, as errors name it.
    folder : Path
        Where designs are looked for.
    """

    where: str
    folder: Path

    def error(self, message: str) -> InputError:
        """An error that names the file."""
        return InputError(message, where=self.where)

    @staticmethod
    def shown(value: object) -> str:
        """A value as it may be printed."""
        return shown(value)

    def only(self, table: Tree, place: str, allowed: set[str]) -> None:
        """Refuse unknown keys, naming the nearest known one."""
        from difflib import get_close_matches

        for key in table:
            if key not in allowed:
                near = get_close_matches(key, sorted(allowed), 1, 0.5)
                hint = f' (nearest known: "{near[0]}")' if near else ""
                path = self.shown(f"{place}.{key}" if place else key)[1:-1]
                raise self.error(f"{path}: unknown key{hint}; allowed: {', '.join(sorted(allowed))}")

    def table(self, tree: Tree, key: str, place: str = "", *, optional: bool = False) -> Tree:
        """A table."""
        path = f"{place}.{key}" if place else key
        if key not in tree:
            if optional:
                return {}
            raise self.error(f"[{path}]: missing; allowed: a table")
        if not isinstance(tree[key], dict):
            raise self.error(f"{path} = {self.shown(tree[key])}: allowed: a table")
        return tree[key]

    def tables(self, tree: Tree, key: str, place: str = "") -> list[Tree]:
        """A list of tables, empty where there is none."""
        result = tree.get(key, [])
        if not isinstance(result, list) or not all(isinstance(item, dict) for item in result):
            path = f"{place}.{key}" if place else key
            raise self.error(f"{path}: allowed: a list of tables, [[{key}]]")
        return result

    def text(
        self, table: Tree, place: str, key: str, otherwise: str | None = None, longest: int = 2000
    ) -> str:
        """A text; missing is an error unless there is a default."""
        if key not in table:
            if otherwise is None:
                raise self.error(f"{place}.{key}: missing; allowed: a text")
            return otherwise
        value = table[key]
        if not isinstance(value, str) or not 0 < len(value.strip()) <= len(value) <= longest:
            raise self.error(
                f"{place}.{key} = {self.shown(value)}: allowed: a text of 1 to {longest} characters"
            )
        return value

    def flag(self, table: Tree, place: str, key: str, otherwise: bool) -> bool:
        """True or false."""
        value = table.get(key, otherwise)
        if not isinstance(value, bool):
            raise self.error(f"{place}.{key} = {self.shown(value)}: allowed: true or false")
        return value

    def integer(self, table: Tree, place: str, key: str, otherwise: int, low: int, high: int) -> int:
        """A whole number in a range."""
        value = table.get(key, otherwise)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.error(f"{place}.{key} = {self.shown(value)}: allowed: a whole number, {low} to {high}")
        return value

    def design(self, name: str) -> Design:
        """A shipped design by name, or a design file beside the study file."""
        from actuator_lti.design import load_design, shipped_designs

        if name in shipped_designs():
            return load_design(name)
        return load_design(self.folder / name)

    def motor(self, name: str) -> Tree:
        """The [motor] table of a file beside the study file."""
        where = self.shown(name)[1:-1]
        tree = read_toml(self.folder / name, "file with a [motor] table")
        if not isinstance(tree.get("motor"), dict):
            raise InputError("no [motor] table; allowed: a TOML file with one", where=where)
        return tree["motor"]

    def located(self, place: str, make: Callable[[], T]) -> T:
        """Call something whose errors shall name this file and a place in it."""
        try:
            return make()
        except InputError as error:
            raise self.error(f"{place}: {error}") from error
