"""One registry of every key of a design file: unit, symbol, allowed range, what it means."""

from collections.abc import Iterator
from dataclasses import MISSING, fields, replace
from typing import Any, get_args

from actuator_lti.design.field import Field, Structure, named_after
from actuator_lti.design.sections import HEAD, RECORDS, SECTIONS, template_of

__all__ = ["ALL_FIELDS", "FIELDS", "Field", "Structure", "field_of", "fields_in"]


def _declared(kind: type, template: str) -> Iterator[Field]:
    """The keys that a part of a design declares beside its attributes."""
    form = "for the continuous form alone, beside the law that runs: "  # it is not the one that runs
    for item in fields(kind):
        annotated, *declared = get_args(item.type)[:2] if hasattr(item.type, "__metadata__") else (None,)
        for field in (named_after(one, item.name) for one in declared):
            yield replace(
                field,
                path=f"{template}.{field.path}",
                required=field.required or item.default is MISSING,
                default=item.default,
                choices=field.choices or (_words(annotated) if field.kind in ("choice", "names") else ()),
                description=form * template.endswith(".continuous") + field.description,
            )


def _words(kind: Any) -> tuple[str, ...]:
    """Those of a Literal, which may be optional or repeated."""
    parts = get_args(kind)
    return parts if all(isinstance(part, str) for part in parts) else get_args(parts[0])


_IN = {one.template: tuple(_declared(one.kind, one.template)) for one in (HEAD, *SECTIONS, *RECORDS)}

ALL_FIELDS: tuple[Field, ...] = tuple(field for one in (HEAD, *SECTIONS) for field in _IN[one.template])
"""Every key, in the order of a design file, without those of the lists at its end."""

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


def fields_in(section: str) -> tuple[Field, ...]:
    """All keys of a section such as ``"control.velocity"``, ``"gear.*"`` or ``"requirement"``."""
    return _IN.get(section, ())
