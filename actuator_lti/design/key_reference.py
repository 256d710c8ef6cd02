"""Every key of a design file as a list to read, and how the numbers of one file are read."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from math import inf
from typing import Annotated

from actuator_lti.design.data_sheet import SHEET, stated_in
from actuator_lti.design.field import BIG, Field, Structure
from actuator_lti.design.fields import FIELDS, RECORDS, field_of, fields_in
from actuator_lti.design.model import Axis, Design
from actuator_lti.design.units import ampere_unit
from actuator_lti.files.reading import Tree


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

    >>> entry = next(key for key in key_reference() if key.path == "control.velocity.every")
    >>> entry.default, entry.allowed
    ('1', 'at least 1 and at most 1000')
    """
    order = list(dict.fromkeys(field.section for field in FIELDS.values()))
    listed = sorted((*FIELDS.values(), *SHEET), key=lambda field: order.index(field.section))
    return tuple(_entry(field, Structure(axis)) for field in listed)


def record_reference(axis: Axis = "rotary") -> tuple[KeyEntry, ...]:
    """The keys of the lists at the end of a file: requirements, waivers, correlations, facts."""
    return tuple(_entry(field, Structure(axis)) for record in RECORDS for field in fields_in(record.template))


def _entry(field: Field, structure: Structure) -> KeyEntry:
    unit = "of its quantity" if field.kind == "limit" else field.unit(structure)
    same: Tree = {item.name: getattr(field, item.name, None) for item in fields(KeyEntry)}
    default = "" if field.required or field.section == "design" else _default(field, unit)
    return KeyEntry(**{**same, "unit": unit, "default": default, "allowed": _allowed(field, unit)})


def _allowed(field: Field, unit: str) -> str:
    if field.kind in ("text", "label"):
        return ""
    if field.high != BIG:
        return field.allowed(unit)
    if field.low > 0:
        return "above 0"
    return "0 or more" if field.low == 0 else ""


def _default(field: Field, unit: str) -> str:
    value = field.default
    if value in (None, "", inf):
        return "none" if value == inf else ""
    if isinstance(value, bool):
        return f"{value}".lower()
    if isinstance(value, tuple):
        return ", ".join(f"{item:g}" for item in value)
    text = value if isinstance(value, str) else f"{value:.10g}"
    return text if unit == "1" or value == 0 else f"{text} {unit}"


@dataclass(frozen=True)
class Explained:
    """One number of a file, by its dotted key."""

    path: Annotated[str, "Key"]
    written: Annotated[str, "Written"]  # as the file has it
    read: Annotated[str, "Read as"]  # in SI
    model: Annotated[str, "In the model as"]  # symbol and value, of the equivalent DC motor


def explained(design: Design) -> tuple[Explained, ...]:
    """Every number that stands in the file of a design, in its order.

    >>> from actuator_lti.design import load_design
    >>> items = {item.path: item for item in explained(load_design("ballscrew"))}
    >>> one = items["motor.torque_constant"]
    >>> one.written, one.read, one.model
    ('0.50 N*m/A', '314.159265 N/A', 'kM = 256.509966 N/A dc')
    """
    result = []
    for path, item in design.parameters.items():
        field, value = field_of(path), item.value
        if path.startswith("motor.") and field is not None:
            value = getattr(design.effective_motor, field.attribute)
        read, made = (
            f"{number:.9g} {ampere_unit(of, item.unit, design.motor.constants)}".removesuffix(" 1")
            for number, of in ((item.value, path), (value, "limits."))
        )
        modelled = f"{item.symbol}{' = ' * bool(item.symbol)}{made}"
        result.append(Explained(path, item.stated or item.text, read, modelled))
    sheet = (Explained(*stated, "friction, below") for stated in stated_in(design))
    at = next((k for k, one in enumerate(result) if one.path.startswith("friction.")), len(result))
    return (*result[:at], *sheet, *result[at:], *_own_law(design))


def _own_law(design: Design) -> Iterator[Explained]:
    """What a law of one's own takes and gives: amperes and volts are those of the equivalent DC motor."""
    own, dc = design.controller.own_law, "" if design.motor.constants == "dc" else " dc"
    if own is None:
        return
    angle = "m" if design.axis == "linear" else "rad"
    of = {"position": angle, "velocity": f"{angle}/s", "current": f"A{dc}", "voltage": f"V{dc}"}
    kinds = {"speed": "velocity", "output_speed": "velocity", "current": "current"}
    kinds |= dict.fromkeys(("command", "error"), own[0])
    takes = ", ".join(f"{name} in {of[kinds.get(name, 'position')]}" for name in own[1].inputs)
    stages = (*design.controller.stages, "voltage")
    gives = stages[stages.index(own[0]) + 1]
    yield Explained(f"control.{own[0]}.law", "inputs, output", takes, f"gives the {gives} in {of[gives]}")
