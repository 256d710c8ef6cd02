"""A design, or a part of one, with other values."""

from dataclasses import replace
from typing import Any, TypeVar

Part = TypeVar("Part")


def changed(part: Part, **values: Any) -> Part:
    """With other values; a dict changes part of a part: ``changed(design, limits={"voltage_V": 9.0})``."""
    made = {
        name: changed(getattr(part, name), **value) if isinstance(value, dict) else value
        for name, value in values.items()
    }
    return replace(part, **made)  # type: ignore[type-var]
