"""Tolerances: read from the design file, made absolute, checked against the allowed range."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Any

from actuator_lti.design.fields import Field
from actuator_lti.design.model import Design, Tolerance
from actuator_lti.design.units import parse_quantity
from actuator_lti.errors import InputError

Parse = Callable[[Any], float]


def _width(text: str | float | int, nominal: float, parse: Parse) -> float:
    """A half width or a standard deviation in SI; relative where written in percent."""
    if isinstance(text, str) and text.strip().endswith("%"):
        width = parse_quantity(text, "1") * abs(nominal)
    else:
        width = parse(text)
    if width <= 0.0:
        raise InputError("allowed: above 0")
    return width


def read_tolerance(raw: Any, nominal: float, parse: Parse, field: Field, unit: str) -> Tolerance:
    """The tolerance of a value from its text (half width of a uniform one) or its table.

    ``parse`` reads a quantity of this key into SI.

    Raises
    ------
    InputError
        If a part is missing or too many, or the tolerance leaves the allowed range of the key.
    """
    if isinstance(raw, str | int | float):
        text = raw if isinstance(raw, str) else repr(raw)
        tolerance = Tolerance(kind="uniform", half_width=_width(raw, nominal, parse), text=text)
    else:
        tolerance = _from_table(raw, nominal, parse)
    check_tolerance(tolerance, nominal, unit, field)
    return tolerance


def _from_table(raw: Any, nominal: float, parse: Parse) -> Tolerance:
    wanted, unwanted = ("half_width", "std") if raw.kind == "uniform" else ("std", "half_width")
    given = getattr(raw, wanted)
    bounds = {key: getattr(raw, key) for key in ("lower", "upper") if getattr(raw, key) is not None}
    if given is None:
        raise InputError(f'missing {wanted}; a "{raw.kind}" tolerance needs it')
    if getattr(raw, unwanted) is not None:
        raise InputError(f'a "{raw.kind}" tolerance has {wanted}, no {unwanted}')
    if bool(bounds) != (raw.kind == "truncated-normal"):
        raise InputError('allowed: lower or upper with kind "truncated-normal", and only there')
    return Tolerance(
        kind=raw.kind,
        lower=parse(bounds["lower"]) if "lower" in bounds else -inf,
        upper=parse(bounds["upper"]) if "upper" in bounds else inf,
        text=given if isinstance(given, str) else repr(given),
        **{wanted: _width(given, nominal, parse)},
    )


def check_tolerance(tolerance: Tolerance, nominal: float, unit: str, field: Field) -> None:
    """Refuse a tolerance whose values may be impossible (a half width that reaches a negative inertia)."""
    if field.kind == "integer":
        raise InputError("allowed: none, a whole number has no tolerance")
    width = tolerance.half_width or 0.0
    if not (field.accepts(nominal - width) and field.accepts(nominal + width)):
        raise InputError(f"reaches values that are not allowed; allowed: {field.allowed(unit)}")
    if not tolerance.lower <= nominal <= tolerance.upper:
        raise InputError("allowed: lower and upper on either side of the value")


def rescaled(tolerance: Tolerance, nominal: float) -> Tolerance:
    """The tolerance of a changed nominal: a relative one follows it, an absolute one stays."""
    if not tolerance.text.strip().endswith("%"):
        return tolerance
    width = _width(tolerance.text, nominal, lambda text: parse_quantity(text, "1"))
    wide = width if tolerance.kind == "uniform" else None
    std = None if tolerance.kind == "uniform" else width
    return Tolerance(
        kind=tolerance.kind,
        half_width=wide,
        std=std,
        lower=tolerance.lower,
        upper=tolerance.upper,
        text=tolerance.text,
    )


def tolerances(design: Design) -> tuple[tuple[str, float, Tolerance], ...]:
    """Every toleranced parameter: dotted key, nominal in SI, tolerance; in the order of the file."""
    return tuple(
        (p.path, p.value, p.tolerance) for p in design.parameters.values() if p.tolerance is not None
    )
