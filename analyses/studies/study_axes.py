"""One axis of a sweep or grid: a parameter and its values as a design file writes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_lti.bounds import AXIS_POINTS
from actuator_lti.files.tree import Tree
from analyses.studies.study_reading import Reader

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

MOST_POINTS = AXIS_POINTS.most


@dataclass(frozen=True)
class Axis:
    """A parameter and its values, as texts or numbers."""

    parameter: str
    values: tuple[Any, ...]


def read_axis(table: Tree, place: str, base: Design, reader: Reader) -> Axis:
    """Read ``values``, or ``from``, ``to``, ``points`` and ``spacing`` ("linear" or "log")."""
    reader.only(table, place, {"parameter", "values", "from", "to", "points", "spacing"})
    parameter = reader.text(table, place, "parameter")
    if "values" in table:
        return Axis(parameter, _listed(table["values"], place, reader))
    return Axis(parameter, _ranged(table, place, parameter, base, reader))


def _listed(values: Any, place: str, reader: Reader) -> tuple[Any, ...]:
    good = isinstance(values, list) and 0 < len(values) <= MOST_POINTS
    if not good or not all(isinstance(v, str | int | float) for v in values):
        raise reader.error(f"{place}.values: allowed: a list of 1 to {MOST_POINTS} texts or numbers")
    return tuple(values)


def _ranged(table: Tree, place: str, parameter: str, base: Design, reader: Reader) -> tuple[Any, ...]:
    from actuator_lti.design.fields import Structure, field_of
    from actuator_lti.design.units import parse_quantity

    field = field_of(parameter)
    if field is None or field.kind != "quantity":
        raise reader.error(f"{place}.parameter = {reader.shown(parameter)}: allowed: a key with a quantity")
    unit = field.unit(Structure.of(base))
    ends = []
    for key in ("from", "to"):
        if not isinstance(table.get(key), str | int | float):
            raise reader.error(f"{place}.{key}: missing; allowed: a quantity in {unit}, or a list of values")
        ends.append(reader.located(f"{place}.{key}", lambda k=key: parse_quantity(table[k], unit)))  # type: ignore[misc]
    points = reader.integer(table, place, "points", 5, 2, MOST_POINTS)
    spacing = reader.text(table, place, "spacing", "linear")
    if spacing not in ("linear", "log") or (spacing == "log" and not min(ends) > 0.0):
        raise reader.error(f'{place}.spacing: allowed: "linear", or "log" between values above 0')
    low, high = ends
    values = np.geomspace(low, high, points) if spacing == "log" else np.linspace(low, high, points)
    shown = [f"{value:.6g}" for value in values]
    return tuple(float(text) if unit == "1" else f"{text} {unit}" for text in shown)
