"""Tolerances: read from the design file, made absolute, checked against the allowed range."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, get_args, get_type_hints

from actuator_lti.design.fields import Field
from actuator_lti.design.model import Design, Tolerance
from actuator_lti.design.units import parse_quantity
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree

Parse = Callable[[Any], float]
_KEYS = ("kind", "half_width", "std", "lower", "upper")
_TORQUE, _BACK_EMF = "motor.torque_constant", "motor.back_emf_constant"  # one constant, moved by one factor
_KINDS: tuple[str, ...] = get_args(get_type_hints(Tolerance)["kind"])


def _width(text: str | float | int, nominal: float, parse: Parse) -> float:
    if isinstance(text, str) and text.strip().endswith("%"):
        width = parse_quantity(text, "1") * abs(nominal)
    else:
        width = parse(text)
    if width <= 0.0:
        raise InputError("allowed: above 0; an exact value is written without a tolerance")
    return width


def read_tolerance(raw: Any, nominal: float, parse: Parse, field: Field, unit: str) -> Tolerance:
    """The tolerance of a value from its text (half width of a uniform one) or its table.

    ``parse`` reads a quantity of this key into SI. An InputError where a part is missing or too many, or the
    tolerance leaves the allowed range of the key; its ``where`` is the key of a table that is wrong.
    """
    table = raw if isinstance(raw, dict) else {"half_width": raw}
    if isinstance(raw, bool | list) or not isinstance(raw, dict | str | int | float):
        raise InputError('allowed: a half width such as "50 %", or a table')
    for key, value in table.items():
        if key not in _KEYS:
            raise InputError(f"unknown key; allowed: {', '.join(_KEYS)}", where=key)
        if key != "kind" and (isinstance(value, bool) or not isinstance(value, str | int | float)):
            raise InputError("allowed: a number with its unit, as text", where=key)
    tolerance = _from_table(table, nominal, parse)
    _refuse_impossible(tolerance, nominal, unit, field)
    return tolerance


def _from_table(table: Tree, nominal: float, parse: Parse) -> Tolerance:
    kind = table.get("kind", "uniform")
    if kind not in _KINDS:
        raise InputError("allowed: " + " or ".join(f'"{one}"' for one in _KINDS), where="kind")
    wanted, unwanted = ("half_width", "std") if kind == "uniform" else ("std", "half_width")
    bounds = {key: table[key] for key in ("lower", "upper") if key in table}
    if wanted not in table:
        raise InputError(f'missing {wanted}; a "{kind}" tolerance needs it')
    if unwanted in table:
        raise InputError(f'a "{kind}" tolerance has {wanted}, no {unwanted}')
    if bool(bounds) != (kind == "truncated-normal"):
        raise InputError('allowed: lower or upper with kind "truncated-normal", and only there')
    given = table[wanted]
    text = given if isinstance(given, str) else repr(given)
    read = {key: parse(bound) for key, bound in bounds.items()}
    return Tolerance(kind=kind, text=text, **{wanted: _width(given, nominal, parse)}, **read)


def _refuse_impossible(tolerance: Tolerance, nominal: float, unit: str, field: Field) -> None:
    width = tolerance.half_width or 0.0
    if field.kind == "integer":
        raise InputError("allowed: none, a whole number has no tolerance")
    if not (field.accepts(nominal - width) and field.accepts(nominal + width)):
        raise InputError(f"reaches values that are not allowed; allowed: {field.allowed(unit)}")
    if not tolerance.lower <= nominal <= tolerance.upper:
        raise InputError("allowed: lower and upper on either side of the value")


def rescaled(tolerance: Tolerance, nominal: float) -> Tolerance | None:
    """The tolerance of a changed nominal: a relative one follows it; of 0 and beyond limits there is none."""
    if not tolerance.lower <= nominal <= tolerance.upper:
        return None
    if not tolerance.relative:
        return tolerance
    if nominal == 0.0:
        return None
    width = abs(nominal) * parse_quantity(tolerance.text, "1")
    return replace(tolerance, half_width=width) if tolerance.std is None else replace(tolerance, std=width)


def tolerances(design: Design) -> tuple[tuple[str, float, Tolerance], ...]:
    """Every toleranced parameter: dotted key, nominal in SI, tolerance; in the order of the file."""
    return tuple((p.path, p.value, p.tolerance) for p in design.parameters.values() if p.tolerance)


def drawn(design: Design) -> tuple[tuple[str, float, Tolerance], ...]:
    """Those that vary on their own: kE follows kM unless a correlation says how it goes."""
    every = tolerances(design)
    stated = any(_BACK_EMF in (pair.first, pair.second) for pair in design.correlations)
    led = not stated and any(path == _TORQUE for path, *_ in every)
    return tuple(each for each in every if not (led and each[0] == _BACK_EMF))


def together(design: Design, values: Mapping[str, Any]) -> dict[str, Any]:
    """Values, or arrays, with kM or kE besides by the same factor as the other, where it has none."""
    for path, other in ((_TORQUE, _BACK_EMF), (_BACK_EMF, _TORQUE)):
        if path in values and other not in values and {path, other} <= design.parameters.keys():
            now, then = (float(design.parameters[one].value) for one in (path, other))
            return {**values, other: values[path] * (then / now)}
    return dict(values)
