"""Every key of a design file as a list to read: made from the registry of fields, so it cannot drift."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, fields
from math import inf
from typing import Annotated

from actuator_lti.design.data_sheet import SHEET
from actuator_lti.design.field import BIG, Field, Structure
from actuator_lti.design.fields import ALL_FIELDS
from actuator_lti.design.model import Axis
from actuator_lti.design.sections import SECTIONS


@dataclass(frozen=True)
class KeyEntry:
    """One key: dotted path, unit, default and range as text, meaning and example."""

    path: Annotated[str, "Key"]
    section: str
    key: str
    symbol: str
    unit: Annotated[str, "Unit"]
    default: Annotated[str, "Default"]
    allowed: Annotated[str, "Allowed"]
    required: Annotated[bool, "Required"]
    description: Annotated[str, "Meaning"]
    example: Annotated[str, "Example"]


def key_reference(axis: Axis = "rotary") -> tuple[KeyEntry, ...]:
    """All keys in the order of a design file, with the units of a full cascade on this axis.

    Examples
    --------
    >>> entry = next(key for key in key_reference() if key.path == "control.velocity.every")
    >>> entry.default, entry.allowed
    ('1', 'at least 1 and at most 1000')
    """
    kinds = {section.template: section.kind for section in SECTIONS}
    structure = Structure(axis)
    order = list(dict.fromkeys(field.section for field in ALL_FIELDS))
    listed = sorted((*ALL_FIELDS, *SHEET), key=lambda field: order.index(field.section))
    return tuple(_entry(field, kinds.get(field.section), structure) for field in listed)


def _entry(field: Field, kind: type | None, structure: Structure) -> KeyEntry:
    unit = "1" if field.kind in ("text", "label", "choice", "flag") else field.unit(structure)
    same = {item.name: getattr(field, item.name) for item in fields(KeyEntry) if hasattr(field, item.name)}
    return KeyEntry(
        **{
            **same,
            "unit": unit,
            "default": "" if field.required else _default(field, kind, unit),
            "allowed": _allowed(field, unit),
        }
    )


def _default(field: Field, kind: type | None, unit: str) -> str:
    known = {item.name: item.default for item in fields(kind)} if kind is not None else {}
    value = known.get(field.attribute, MISSING)
    if value is MISSING or value is None or value in ("", ()):
        return ""
    if value == inf:
        return "none"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        return ", ".join(f"{item:g}" for item in value)
    text = value if isinstance(value, str) else f"{value:.10g}"
    return text if unit == "1" or value == 0 else f"{text} {unit}"


def _allowed(field: Field, unit: str) -> str:
    if field.kind in ("text", "label"):
        return ""
    if field.kind in ("quantity", "quantities", "matrix") and field.low == -BIG and field.high == BIG:
        return ""
    if field.high == BIG:
        return "above 0" if field.low > 0 else "0 or more"
    return field.allowed(unit)
