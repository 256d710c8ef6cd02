"""Relations between keys that one line says: the key that is refused, what is allowed, and when it is not."""

from collections.abc import Callable, Iterator
from dataclasses import MISSING, dataclass
from typing import Any

from actuator_lti.design.field import Structure
from actuator_lti.design.fields import BY_PATH, FIELDS, part_at
from actuator_lti.design.mistakes import Refusal
from actuator_lti.design.model import Design


@dataclass(frozen=True)
class Rule:
    """A key that is said, or a table that is there, and must not be; ``allowed`` shows values of ``d``."""

    key: str
    allowed: str
    broken: Callable[[Any], Any]

    def __call__(self, design: Design) -> Iterator[Refusal]:
        there = bool(part_at(design, self.key)) if self.key in BY_PATH else is_said(design, self.key)
        if there and self.broken(design):
            yield self.key, as_said(design, self.key), self.allowed.format(d=design)


def value_of(design: Design, path: str) -> Any:
    return getattr(part_at(design, FIELDS[path].section), FIELDS[path].attribute, None)


def is_said(design: Design, path: str) -> bool:
    value, default = value_of(design, path), FIELDS[path].default
    return value is not None and (default is None or default is MISSING or value != default)


def as_said(design: Design, path: str) -> str:
    """The value of a key as its file has it; in SI where that has another, or none."""
    if path in BY_PATH:
        return "a table"
    value, known = value_of(design, path), design.parameters.get(path)
    if known is not None and known.value == value:
        return known.text
    if isinstance(value, str | bool):
        return f'"{value}"' if isinstance(value, str) else f"{value}".lower()
    unit = FIELDS[path].unit(Structure.of(design))
    return f"{value:g}" if unit == "1" else f"{value:g} {unit}"
