"""Limits of figures as text: the figures themselves stand in `actuator_lti.asked.quantities`."""

from __future__ import annotations

from actuator_lti.asked.quantities import QUANTITIES
from actuator_lti.design.units import convert, parse_quantity, parse_unit, split_quantity
from actuator_lti.errors import InputError

__all__ = ["QUANTITIES", "parse_limit"]


def parse_limit(text: str | float | int, unit: str) -> float:
    """A limit as written, in the unit in which its quantity is reported.

    Examples
    --------
    >>> parse_limit("6 dB", "dB"), parse_limit("90 rpm", "Hz")
    (6.0, 1.5)
    """
    if unit in ("1", "%"):
        value = parse_quantity(text, "1")
        return value * 100.0 if unit == "%" else value
    if unit == "dB":
        return _decibel(text)
    if not isinstance(text, str):
        raise InputError(f"has no unit; allowed: a number with a unit like {unit}")
    try:
        number, written = split_quantity(text)
    except ValueError as error:
        raise InputError(f"{error}; allowed: a number with a unit like {unit}") from None
    if written == unit:
        return number
    if "[angle]" in dict(parse_unit(unit).dimension):
        try:
            return convert(parse_quantity(text, _si(unit)), _si(unit), unit)
        except InputError:
            raise InputError(f"wrong unit; allowed: a number with a unit like {unit}") from None
    return parse_quantity(text, unit)


def _si(unit: str) -> str:
    return {"deg": "rad", "Hz": "rad/s", "deg/s": "rad/s", "deg/s^2": "rad/s^2"}.get(unit, unit)


def _decibel(text: str | float | int) -> float:
    try:
        number, written = split_quantity(str(text))
    except ValueError as error:
        raise InputError(f"{error}; allowed: a number in dB") from None
    if written != "dB":
        raise InputError('allowed: a number in dB such as "6 dB"')
    return number
