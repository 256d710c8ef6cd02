"""One registry of every key of a design file: unit, symbol, allowed range, what it means."""

from __future__ import annotations

from functools import cache

from actuator_lti.design.field import Field, Structure
from actuator_lti.design.field_table import ALL_FIELDS
from actuator_lti.design.sections import template_of

__all__ = ["FIELDS", "Field", "Structure", "field_of", "fields_in"]

FIELDS: dict[str, Field] = {field.path: field for field in ALL_FIELDS}
"""Every key of a design file by its dotted path; repeated tables stand under ``*`` (``gear.*``)."""


def field_of(path: str) -> Field | None:
    """The field of a dotted path such as ``"gear.planetary.ratio"``; None if there is none.

    Examples
    --------
    >>> field_of("gear.worm.ratio").path
    'gear.*.ratio'
    """
    return None if "*" in path else FIELDS.get(template_of(path))


@cache
def fields_in(section: str) -> tuple[Field, ...]:
    """All keys of a section such as ``"control.velocity"`` or ``"gear.*"``."""
    return tuple(field for field in ALL_FIELDS if field.section == section)
