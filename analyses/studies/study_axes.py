"""One axis of a sweep or grid: a parameter and its values as a design file writes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from actuator_lti.bounds import AXIS_POINTS
from actuator_lti.design.fields import Structure, field_of
from actuator_lti.design.model import Design
from analyses.toml_tables import Table


@dataclass(frozen=True)
class Axis:
    """A parameter and its values, as texts or numbers."""

    parameter: str
    values: tuple[Any, ...]


@dataclass(frozen=True, kw_only=True)
class _Written:
    """An axis as written; beside it stand ``values``, or ``from`` and ``to``."""

    parameter: str
    points: int = 5
    spacing: Literal["linear", "log"] = "linear"


def read_axis(table: Table, base: Design) -> Axis:
    """Read ``values``, or ``from``, ``to``, ``points`` and ``spacing`` ("linear" or "log")."""
    one = table.read(_Written, beside=("values", "from", "to"))
    return Axis(one.parameter, _listed(table) if "values" in table else _ranged(table, one, base))


def _listed(table: Table) -> tuple[Any, ...]:
    values = table.data["values"]
    good = isinstance(values, list) and 0 < len(values) <= AXIS_POINTS.most
    if not good or not all(isinstance(v, str | int | float) for v in values):
        raise table.fail("values", f"allowed: a list of 1 to {AXIS_POINTS.most} texts or numbers")
    return tuple(values)


def _ranged(table: Table, one: _Written, base: Design) -> tuple[Any, ...]:
    field = field_of(one.parameter)
    if field is None or field.kind != "quantity":
        raise table.fail("parameter", "allowed: a key with a quantity")
    unit = field.unit(Structure.of(base))
    low, high = (table.quantity(key, unit) for key in ("from", "to"))
    if not 2 <= one.points <= AXIS_POINTS.most:
        raise table.fail("points", f"allowed: a whole number, 2 to {AXIS_POINTS.most}")
    log = one.spacing == "log"
    if log and not min(low, high) > 0.0:
        raise table.fail("spacing", 'allowed: "log" between values above 0')
    values = np.geomspace(low, high, one.points) if log else np.linspace(low, high, one.points)
    texts = [f"{value:.6g}" for value in values]
    return tuple(float(text) if unit == "1" else f"{text} {unit}" for text in texts)
