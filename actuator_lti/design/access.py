"""Values of a design by dotted path, and designs with some values changed."""

from collections.abc import Mapping
from dataclasses import replace
from math import inf
from typing import Any

from actuator_lti.design.asked import FrozenMap, Parameter
from actuator_lti.design.checks import contradictions
from actuator_lti.design.fields import Field, Structure, field_of, fields_in, part_at, parts_of, with_part
from actuator_lti.design.mistakes import Findings, nearest
from actuator_lti.design.model import Design
from actuator_lti.design.tolerances import rescaled, together
from actuator_lti.design.units import ampere_unit, si_text
from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown


def paths_of(design: Design) -> tuple[str, ...]:
    """Dotted paths of all numeric keys that this design has a value for."""
    return tuple(
        f"{path}.{field.key}"
        for section, path, part in parts_of(design)
        if not (section.rare and part == section.kind())
        for field in fields_in(section.template)
        if field.is_number
        and (value := getattr(part, field.attribute)) is not None
        and value != inf
        and (value != 0.0 or field.accepts(value))  # 0: the gain of a stage with a law of one's own
    )


def located(design: Design, path: str) -> tuple[Field, Any]:
    """The field of a numeric path and the part of the design that holds it; an InputError for any other."""
    if not isinstance(design, Design) or not isinstance(path, str):
        given = f"design = {shown(design)}, key = {shown(path)}"
        raise InputError(f"{given}: allowed: a Design (load_design) and a dotted key")
    field, table = field_of(path), path.rpartition(".")[0]
    if field is None or not field.is_number:
        hint = nearest(path, paths_of(design))
        raise InputError(f"{shown(path)}: unknown parameter{hint}; allowed: a numeric key of the design file")
    part = part_at(design, table)
    if part is None:
        raise InputError(f"{path}: the design {design.name} has no {table}")
    return field, part


def parameter_value(design: Design, path: str) -> float:
    """The SI value of a numeric key by its dotted path; an InputError where the design has none.

    >>> from actuator_lti.design import load_design
    >>> parameter_value(load_design("ilr33-amber"), "motor.resistance")
    0.055
    """
    field, part = located(design, path)
    value = getattr(part, field.attribute)
    if value is None:
        raise InputError(f"{path}: the design {design.name} has no value for it")
    return float(value)


def with_values(design: Design, values: Mapping[str, float], *, check: bool = True) -> Design:
    """A copy of a design with some numeric keys, by their dotted paths, changed to SI values.

    A tolerance in percent follows its value, one cut at limits that a value leaves is gone. ``check``:
    whether the relations between keys are checked too (kE against kM); each value alone always is.

    >>> from actuator_lti.design import load_design
    >>> with_values(load_design("ilr33-amber"), {"motor.resistance": 0.06}).motor.resistance_ohm
    0.06
    """
    parameters = {path: _changed(design, path, value) for path, value in values.items()}
    gone = {path for path, item in parameters.items() if item.tolerance is None}
    changed = replace(
        stacked(design, {path: item.value for path, item in parameters.items()}),
        parameters=FrozenMap({**design.parameters, **parameters}),
        correlations=tuple(pair for pair in design.correlations if not gone & {pair.first, pair.second}),
    )
    if check:
        Findings(design.origin or design.name).refuse(contradictions(changed))
    return changed


def varied(design: Design, values: Mapping[str, Any]) -> Design:
    """A drive that came out with other SI values, its controller still set for the nominal one.

    With kM goes kE (`together`); values are refused one by one, not for what they are to each other.
    """
    changed = with_values(design, together(design, values), check=False)
    return replace(changed, nominal=design.nominal or design)


def _changed(design: Design, path: str, value: float) -> Parameter:
    (field, _), old = located(design, path), design.parameters.get(path)
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        raise InputError(f"{path} = {shown(value)}: allowed: a number")
    number, unit, whole = float(value), field.unit(Structure.of(design)), field.kind == "integer"
    if not field.fits(number):
        raise InputError(f"{path} = {number!r}: allowed: {'a whole number, ' * whole}{field.allowed(unit)}")
    number = int(number) if whole else number
    if old is not None and old.value == number:
        return old
    text = si_text(number, unit_in_file(design, path, field))
    new = Parameter(path=path, text=text, value=number, unit=unit, symbol=field.symbol, source="changed")
    if old is None:
        return new
    grade = old.grade if old.source.startswith("changed") else ""
    tolerance = None if old.tolerance is None else rescaled(old.tolerance, number)
    return replace(new, source=f"changed from {old.text}", grade=grade, tolerance=tolerance)


def unit_in_file(design: Design, path: str, field: Field) -> str:
    """The SI unit of a key as a file has to say it."""
    return ampere_unit(path, field.unit(Structure.of(design)), design.motor.constants)


def stacked(design: Design, values: Mapping[str, Any]) -> Design:
    """A design with other numbers by their dotted keys, or arrays of them: many designs, unchecked."""
    for path, value in values.items():
        field, part = located(design, path)
        design = with_part(design, path.rpartition(".")[0], replace(part, **{field.attribute: value}))
    return design
