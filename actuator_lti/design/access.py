"""Values of a design by dotted path, and designs with some values changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import inf
from typing import Any

from actuator_lti.design.checks import check_relations
from actuator_lti.design.fields import Field, Structure, field_of, fields_in
from actuator_lti.design.mistakes import nearest
from actuator_lti.design.model import Design, Parameter
from actuator_lti.design.parameters import FrozenMap
from actuator_lti.design.sections import part_at, parts_of, with_part
from actuator_lti.design.tolerances import rescaled
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
        if field.kind in ("quantity", "integer") and _has_value(field, getattr(part, field.attribute))
    )


def _has_value(field: Field, value: float | None) -> bool:
    """Whether a key is there; the gain of a stage with a law of one's own is 0, which no gain may be."""
    return value is not None and value != inf and (value != 0.0 or field.accepts(value))


def located(design: Design, path: str) -> tuple[Field, Any]:
    """The field of a numeric path and the part of the design that holds it.

    Raises
    ------
    InputError
        If there is no such key, or the design has no such stage.
    """
    if not isinstance(design, Design) or not isinstance(path, str):
        given = f"design = {shown(design)}, key = {shown(path)}"
        raise InputError(f"{given}: allowed: a Design (load_design) and a dotted key")
    field = field_of(path)
    if field is None or field.kind not in ("quantity", "integer"):
        hint = nearest(path, paths_of(design))
        raise InputError(f"{shown(path)}: unknown parameter{hint}; allowed: a numeric key of the design file")
    part = part_at(design, path.rpartition(".")[0])
    if part is None:
        raise InputError(f"{path}: the design {design.name} has no {path.rpartition('.')[0]}")
    return field, part


def parameter_value(design: Design, path: str) -> float:
    """The SI value of a numeric key by its dotted path, such as ``"gear.worm.ratio"``.

    Raises
    ------
    InputError
        If the key is unknown, or this design has no value for it.

    Examples
    --------
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
    """A copy of a design with some numeric keys changed to SI values.

    Parameters
    ----------
    design : Design
    values : mapping of dotted path to SI value
    check : bool
        Whether the relations between keys are checked too (kE against kM, speed against supply);
        each value alone is always held to its allowed range.

    Returns
    -------
    Design
        Its parameters carry the new values; a tolerance in percent follows them.

    Raises
    ------
    InputError
        As :func:`actuator_lti.design.load_design`.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> with_values(load_design("ilr33-amber"), {"motor.resistance": 0.06}).motor.resistance_ohm
    0.06
    """
    structure = Structure.of(design)
    changes: dict[str, dict[str, Any]] = {}
    parameters: dict[str, Parameter] = {}
    for path, value in values.items():
        field, _ = located(design, path)
        number = _allowed(field, path, value, structure)
        changes.setdefault(path.rpartition(".")[0], {})[field.attribute] = number
        parameters[path] = _changed(design.parameters.get(path), field, path, number, design)
    changed = _replaced(design, changes, parameters)
    if check:
        check_relations(changed, design.origin or design.name)
    return changed


def _allowed(field: Field, path: str, value: float, structure: Structure) -> float | int:
    if isinstance(value, bool) or (not isinstance(value, int | float) and not hasattr(value, "__float__")):
        raise InputError(f"{path} = {shown(value)}: allowed: a number")
    number = float(value)
    if not field.accepts(number) or (field.kind == "integer" and number != int(number)):
        whole = "a whole number, " if field.kind == "integer" else ""
        raise InputError(f"{path} = {number!r}: allowed: {whole}{field.allowed(field.unit(structure))}")
    return int(number) if field.kind == "integer" else number


def _changed(old: Parameter | None, field: Field, path: str, value: float, design: Design) -> Parameter:
    if old is not None and old.value == value:
        return old
    unit = field.unit(Structure.of(design))
    text = si_text(value, ampere_unit(path, unit, design.motor.constants))
    new = Parameter(path=path, text=text, value=value, unit=unit, symbol=field.symbol, source="changed")
    if old is None:
        return new
    grade = old.grade if old.source.startswith("changed") else ""
    tolerance = None if old.tolerance is None else rescaled(old.tolerance, value)
    return replace(new, source=f"changed from {old.text}", grade=grade, tolerance=tolerance)


def _replaced(
    design: Design, changes: Mapping[str, Mapping[str, Any]], parameters: Mapping[str, Parameter]
) -> Design:
    for path, attributes in changes.items():
        design = with_part(design, path, replace(part_at(design, path), **attributes))
    gone = {path for path, item in parameters.items() if item.tolerance is None}
    kept = tuple(pair for pair in design.correlations if not gone & {pair.first, pair.second})
    return replace(design, parameters=FrozenMap({**design.parameters, **parameters}), correlations=kept)


def stacked(design: Design, values: Mapping[str, Any]) -> Design:
    """A design with arrays in place of some numbers: many designs of one structure, unchecked."""
    changes: dict[str, dict[str, Any]] = {}
    for path, array in values.items():
        changes.setdefault(path.rpartition(".")[0], {})[located(design, path)[0].attribute] = array
    return _replaced(design, changes, {})
