"""What each key may be by itself, in a design made in Python: of a file's values the reader asks the same."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from math import isfinite
from numbers import Real
from typing import Any

from actuator_lti.design.field import Field, Structure
from actuator_lti.design.fields import FIELDS, fields_in
from actuator_lti.design.mistakes import Refusal
from actuator_lti.design.model import Design
from actuator_lti.design.sections import parts_of
from actuator_lti.files.reading import shown

_WORDS = ("choice", "names")


def out_of_range(design: Design) -> Iterator[Refusal]:
    """Numbers outside their range, or that are none, and words that no key knows."""
    axis = FIELDS["design.axis"]
    if not _fits(axis, design.axis):  # all units follow from it
        yield "design.axis", shown(design.axis), f"allowed: {axis.allowed('1')}"
        return
    for section, path, part in parts_of(design):
        usual = {item.name: item.default for item in fields(part)}
        for field in fields_in(section.template):
            value = getattr(part, field.attribute)
            if not (_left_out(field, value, usual[field.attribute], part) or _fits(field, value)):
                allowed = field.allowed(field.unit(Structure.of(design)))
                yield f"{path}.{field.key}", shown(value), f"allowed: {allowed}"


def _left_out(field: Field, value: Any, usual: Any, part: Any) -> bool:
    """Whether a key is as a file without it has it; a loop's gain may be left out beside a law."""
    needed = field.required and getattr(part, "law", None) is None
    return not needed and type(value) is type(usual) and bool(value == usual)


def _fits(field: Field, value: Any) -> bool:
    """Whether a key takes a value."""
    if isinstance(value, tuple | list):
        return all(_fits(field, one) for one in value)
    if field.kind in _WORDS:
        return value in field.choices
    if field.kind in ("quantity", "integer", "quantities", "matrix"):
        number = isinstance(value, Real) and not isinstance(value, bool) and isfinite(value)
        return number and field.accepts(float(value)) and (field.kind != "integer" or value == int(value))
    return True
