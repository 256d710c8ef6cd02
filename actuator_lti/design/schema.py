"""The shape of a design file, made from the registry of fields: known keys, tables, types, choices."""

from __future__ import annotations

from datetime import date
from functools import lru_cache
from typing import Annotated, Any, Literal, Optional

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    StrictBool,
    StrictFloat,
    StrictInt,
    StrictStr,
    create_model,
)
from pydantic import Field as Slot

from actuator_lti.design.asked import ResponseTo, Rotor
from actuator_lti.design.fields import Field, fields_in
from actuator_lti.design.model import ObjectFamily
from actuator_lti.design.sections import children

MAX_GEARS = 20
MAX_LIST = 200
MAX_OBJECTS = 5000
_STRICT = ConfigDict(extra="forbid", frozen=True)

Written = StrictStr | StrictInt | StrictFloat


class RawTolerance(BaseModel):
    """A tolerance written as a table."""

    model_config = _STRICT
    kind: Literal["uniform", "normal", "truncated-normal"] = "uniform"
    half_width: Written | None = None
    std: Written | None = None
    lower: Written | None = None
    upper: Written | None = None


class Raw(BaseModel):
    """A value as written, with its pedigree."""

    model_config = _STRICT
    value: Written
    source: StrictStr = ""
    grade: StrictStr = ""
    tolerance: Written | RawTolerance | None = None


class RawRequirement(BaseModel):
    """One ``[[requirement]]``."""

    model_config = _STRICT
    id: StrictStr
    quantity: StrictStr
    loop: StrictStr | None = None
    rotor: Rotor | None = None
    to: ResponseTo | None = None
    minimum: Written | None = None
    maximum: Written | None = None
    load: Written | None = None
    source: StrictStr = ""
    note: StrictStr = ""


class RawWaiver(BaseModel):
    """One ``[[waiver]]``; a date of TOML is taken as its text."""

    model_config = _STRICT
    requirement: StrictStr
    reason: StrictStr
    date: Annotated[StrictStr, BeforeValidator(lambda d: d.isoformat() if isinstance(d, date) else d)]


class RawCorrelation(BaseModel):
    """One ``[[correlation]]``."""

    model_config = _STRICT
    first: StrictStr
    second: StrictStr
    coefficient: StrictFloat | StrictInt


class RawFact(BaseModel):
    """One ``[[fact]]``."""

    model_config = _STRICT
    label: StrictStr
    value: StrictStr
    source: StrictStr = ""
    grade: StrictStr = ""


class RawObjects(BaseModel):
    """The motion controller's own objects, ``[objects]``."""

    model_config = _STRICT
    velocity_gain_factor: StrictFloat | StrictInt = 1.0
    family: ObjectFamily = ""
    values: Annotated[dict[str, Any], Slot(max_length=MAX_OBJECTS)] = Slot(default_factory=dict)


def _as_raw(value: Any) -> Any:
    return {"value": value} if isinstance(value, str | int | float) and not isinstance(value, bool) else value


RawEntry = Annotated[Raw, BeforeValidator(_as_raw)]


def _slot(field: Field) -> tuple[Any, Any]:
    kinds: dict[str, Any] = {
        "quantity": RawEntry,
        "integer": RawEntry,
        "quantities": Annotated[list[Written], Slot(min_length=1, max_length=MAX_LIST)],
        "flag": StrictBool,
        "text": StrictStr,
        "choice": Literal[field.choices] if field.choices else StrictStr,
    }
    kind = kinds[field.kind]
    return (kind, ...) if field.required else (Optional[kind], None)  # noqa: UP045


def _many(kind: Any, longest: int) -> Any:
    return (Annotated[list[kind], Slot(max_length=longest)], Slot(default_factory=list))


def _section(template: str, /, **more: Any) -> type[BaseModel]:
    slots: dict[str, Any] = {field.key: _slot(field) for field in fields_in(template)}
    return create_model(template, __config__=_STRICT, **slots, **more)


def _tables(path: str) -> dict[str, Any]:
    """The slots of the tables that lie in a table, each with those inside it."""
    slots: dict[str, Any] = {}
    for section in children(path):
        named = {"name": (StrictStr, ...)} if section.many == "named" else {}
        kind: Any = _section(section.template, **named, **_tables(section.path))
        if section.many:
            slots[section.key] = _many(kind, MAX_GEARS if section.many == "named" else MAX_LIST)
        else:
            slots[section.key] = (kind, ...) if section.required else (kind | None, None)
    return slots


@lru_cache(maxsize=1)
def document_model() -> type[BaseModel]:
    """The pydantic model of a whole design file."""
    return create_model(
        "DesignFile",
        __config__=_STRICT,
        design=(_section("design"), ...),
        requirement=_many(RawRequirement, MAX_LIST),
        waiver=_many(RawWaiver, MAX_LIST),
        correlation=_many(RawCorrelation, MAX_LIST),
        fact=_many(RawFact, MAX_LIST),
        objects=(RawObjects | None, None),
        **_tables(""),
    )
