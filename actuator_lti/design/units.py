"""Quantities as a data sheet writes them: ``"6 uH"``, ``"9.2 g*cm^2"``, ``"9000 rpm"``.

pint does the arithmetic, in a small registry of the units that a drive needs.  The angle is a dimension
of its own here, so that ``120 1/s`` (a gain) and ``120 rad/s`` (a speed) are not mistaken for each other;
where SI lets the radian go (``V*s/rad`` or ``V*s``) it may be left out.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from difflib import get_close_matches
from functools import lru_cache
from math import isfinite
from typing import Any

from actuator_lti.errors import InputError
from actuator_lti.reading import shown

_DEFINITIONS = """
tera- = 1e12 = T-
giga- = 1e9 = G-
mega- = 1e6 = M-
kilo- = 1e3 = k-
centi- = 1e-2 = c-
milli- = 1e-3 = m-
micro- = 1e-6 = u- = µ-
nano- = 1e-9 = n-
pico- = 1e-12 = p-
meter = [length] = m = metre
second = [time] = s = sec
kilogram = [mass] = kg
ampere = [current] = A = amp
radian = [angle] = rad
percent = 0.01
gram = 1e-3 * kilogram = g
inch = 0.0254 * meter = in
foot = 0.3048 * meter = ft
pound = 0.45359237 * kilogram = lb
ounce = 0.028349523125 * kilogram = oz
minute = 60 * second = min
hour = 3600 * second = h
newton = kilogram * meter / second ** 2 = N
pound_force = 4.4482216152605 * newton = lbf
ounce_force = 0.27801385095378125 * newton = ozf
joule = newton * meter = J
newton_meter = newton * meter = Nm
watt = joule / second = W
volt = watt / ampere = V
ohm = volt / ampere = Ω = Ohm
henry = volt * second / ampere = H
farad = ampere * second / volt = F
kelvin = [temperature] = K
celsius = [celsius] = degC
degree = 0.017453292519943295 * radian = deg
turn = 6.283185307179586 * radian = rev = _ = revolution
rpm = 0.10471975511965977 * radian / second
hertz = 6.283185307179586 * radian / second = Hz
"""

_TOKEN = re.compile(r"\s*(?:(?P<name>[A-Za-z_µΩ]+|1(?![0-9.]))|(?P<power>\^-?[1-6])|(?P<sign>[*/()]))")
_NUMBER = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*(.*)\Z", re.DOTALL)
_COMMA = re.compile(r"\s*[+-]?[0-9]*,[0-9]")
_BARE_POWER = re.compile(r"(?<=[A-Za-z])([23])(?![0-9])")
_RUN_TOGETHER = re.compile(r"\b(k?g)(c?m\^2)")
_MAX_TEXT = 120

Dimension = tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class UnitValue:
    """A unit in SI: what to multiply by, and its dimension with the angle counted."""

    factor: float
    dimension: Dimension

    @property
    def angle(self) -> int:
        """The exponent of the angle."""
        return dict(self.dimension).get("[angle]", 0)

    def without_angle(self) -> Dimension:
        """The dimension as SI counts it."""
        return tuple(item for item in self.dimension if item[0] != "[angle]")


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry(None, cache_folder=None)
    registry.load_definitions([line for line in _DEFINITIONS.splitlines() if line])
    return registry


def _tidy(unit: str) -> str:
    text = unit.strip()
    for old, new in (("²", "^2"), ("³", "^3"), ("·", "*"), ("⋅", "*"), ("×", "*"), ("μ", "µ"), ("**", "^")):
        text = text.replace(old, new)
    text = (
        text.replace("°C", " degC").replace("°", " deg").replace("%", " percent").replace("\N{OHM SIGN}", "Ω")
    )
    return _RUN_TOGETHER.sub(r"\1*\2", _BARE_POWER.sub(r"^\1", text)).rstrip()


def _expression(unit: str) -> str:
    """The unit in pint's grammar, let through only if it is a product of powers of names."""
    text, position, depth, last = _tidy(unit), 0, 0, "("
    parts: list[str] = []
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None or len(parts) > 40:
            raise ValueError(f"{shown(unit)} is not a unit")
        kind, token = str(match.lastgroup), match.group().strip()
        operand, ended = kind == "name" or token == "(", last in ("name", ")", "power")
        depth += {"(": 1, ")": -1}.get(token, 0)
        if depth < 0 or not (operand or ended) or (kind == "power" and last == "power"):
            raise ValueError(f"{shown(unit)} is not a unit")
        if operand and ended:
            parts.append("*")
        parts.append(token.replace("^", "**"))
        last = token if kind == "sign" else kind
        position = match.end()
    if depth or last in ("*", "/", "("):
        raise ValueError(f"{shown(unit)} is not a unit")
    return " ".join(parts)


@lru_cache(maxsize=512)
def parse_unit(unit: str) -> UnitValue:
    """Read a unit such as ``"N*m/A"``; the empty text and ``"1"`` are dimensionless.

    Raises
    ------
    ValueError
        If it is no unit, with the nearest known one where there is one.
    """
    import pint

    if len(unit) > _MAX_TEXT:
        raise ValueError("a unit of more than 120 characters")
    if unit.strip() in ("", "1"):
        return UnitValue(1.0, ())
    registry = _registry()
    try:
        quantity = registry.parse_expression(_expression(unit))
        root = registry.Quantity(1.0, "") * quantity
        root = root.to_root_units()
    except pint.UndefinedUnitError as error:
        raise ValueError(_unknown(str(error.unit_names))) from None
    dimension = tuple(sorted((str(k), int(v)) for k, v in root.dimensionality.items()))
    return UnitValue(float(root.magnitude), dimension)


def _unknown(name: str) -> str:
    known = [line.split(" = ")[i].strip() for line in _DEFINITIONS.splitlines() if line for i in (0, -1)]
    name = re.sub(r"[^A-Za-z_µΩ]", "", name.split(",")[0])
    near = get_close_matches(name, [unit for unit in known if not unit.endswith("-")], 1, 0.5)
    return f'unknown unit "{name}"' + (f' (nearest known: "{near[0]}")' if near else "")


def scaled(number: float, factor: float) -> float:
    """``number * factor``, rounded once where the factor is a whole fraction (milli, micro).

    Examples
    --------
    >>> scaled(5.9, 1e-3)
    0.0059
    """
    if 0.0 < factor < 1.0:
        inverse = round(1.0 / factor)
        if inverse <= 10**15 and abs(inverse * factor - 1.0) < 1e-14:
            return float(Decimal(repr(number)) / inverse)
    return number * factor


_KINDS = {
    "ohm": "resistance", "H": "inductance", "V": "voltage", "A": "current", "W": "power", "F": "capacitance",
    "s": "time", "1/s": "gain or rate", "rad/s": "speed or angular frequency", "rad": "angle", "m": "length",
    "kg": "mass", "kg*m^2": "moment of inertia", "N*m": "torque", "N": "force", "m/s": "speed",
    "N*m/A": "torque constant", "V*s/rad": "back-EMF constant", "rad/s^2": "angular acceleration",
    "m/s^2": "acceleration", "N*m*s/rad": "viscous friction", "N*m/rad": "stiffness",
    "degC": "temperature", "K": "temperature difference",
}  # fmt: skip


@lru_cache(maxsize=1)
def _kinds() -> dict[Dimension, str]:
    return {parse_unit(unit).dimension: kind for unit, kind in _KINDS.items()}


def _kind_of(written: str, value: UnitValue) -> str:
    """What a unit measures, in words where there is one."""
    kind = _kinds().get(value.dimension)
    if kind is None:
        return f"has the dimension of {shown(written)}"
    return f"{shown(written)} is the unit of a{'n' if kind[0] in 'aeiou' else ''} {kind}"


def _advice(value: UnitValue, wanted: UnitValue, number: float) -> str:
    """How to get from what is written to what is wanted, where engineers mix the two up."""
    pair = (_kinds().get(value.dimension, ""), _kinds().get(wanted.dimension, ""))
    if pair == ("speed or angular frequency", "gain or rate"):
        return f"; a frequency in Hz becomes a gain in 1/s times 2 pi: {number * value.factor:.6g} 1/s"
    if pair == ("moment of inertia", "mass"):
        return "; a screw of lead p carries J as the mass J (2 pi/p)^2"
    if pair == ("mass", "moment of inertia"):
        return "; a mass m on a screw of lead p is the inertia m (p/2 pi)^2"
    if pair == ("torque", "force"):
        return "; a screw of lead p turns a torque T into the force 2 pi T/p"
    return ""


def split_quantity(text: str) -> tuple[float, str]:
    """Number and unit of a written quantity."""
    match = _NUMBER.match(text) if len(text) <= _MAX_TEXT else None
    if match is None:
        raise ValueError("a number and a unit are wanted")
    if _COMMA.match(text):
        raise ValueError(f"a decimal comma; use a decimal point: {shown(text.replace(',', '.', 1))}")
    number = float(match.group(1))
    if not isfinite(number):
        raise ValueError("must be finite")
    return number, match.group(2).strip()


def compatible(value: UnitValue, wanted: UnitValue) -> bool:
    """Whether a unit may stand for another; a radian in the denominator may be left out."""
    if value.dimension == wanted.dimension:
        return True
    return wanted.angle < 0 and value.angle == 0 and value.without_angle() == wanted.without_angle()


def parse_quantity(text: str | float | int, unit: str) -> float:
    """The SI value of a written quantity whose dimension must be that of ``unit``.

    Parameters
    ----------
    text : str or number
        ``"6 uH"``; a bare number only where ``unit`` is dimensionless.
    unit : str
        The SI unit wanted, such as ``"H"``.

    Returns
    -------
    float
        In ``unit`` (which is to be an SI unit without prefix).

    Raises
    ------
    InputError
        If it is no number, not finite, has an unknown unit or the wrong dimension.

    Examples
    --------
    >>> parse_quantity("9.2 g*cm^2", "kg*m^2")
    9.2e-07
    >>> round(parse_quantity("9000 rpm", "rad/s"), 3)
    942.478
    """
    wanted = parse_unit(unit)
    example = f"a number with a unit like {unit}" if unit not in ("", "1") else "a number without a unit"
    try:
        number, written = (float(text), "") if isinstance(text, int | float) else split_quantity(text)
        if not isfinite(number):
            raise ValueError("must be finite")
        result = parse_unit(written)
    except (ValueError, OverflowError) as error:
        raise InputError(f"{error}; allowed: {example}") from None
    if not compatible(result, wanted):
        missing = "has no unit" if not written else _kind_of(written, result)
        wrong = "wrong dimension, " if written else ""
        raise InputError(f"{wrong}{missing}; allowed: {example}{_advice(result, wanted, number)}")
    value = scaled(number, result.factor)
    if not isfinite(value):
        raise InputError(f"must be finite; allowed: {example}")
    return value


def convert(value: float, unit: str, to: str) -> float:
    """A value in one unit, in another of the same dimension."""
    source, target = parse_unit(unit), parse_unit(to)
    if source.dimension != target.dimension:
        raise InputError(f'"{unit}" cannot be converted to "{to}"')
    return value * source.factor / target.factor
