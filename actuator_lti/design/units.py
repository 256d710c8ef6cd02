"""Quantities as a data sheet writes them: ``"6 uH"``, ``"9.2 g*cm^2"``, ``"9000 rpm"``.

A product of powers of names, its factor rounded once. The angle is a dimension, so that 120 1/s is no
120 rad/s; where SI lets the radian go (``V*s/rad`` or ``V*s``) it may be left out.
"""

from __future__ import annotations

import re
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from difflib import get_close_matches
from fractions import Fraction
from functools import lru_cache
from itertools import product
from math import isfinite, pi
from operator import ne

from actuator_lti.design.spellings import LONGEST, split_quantity, tidy
from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown

_PREFIXES = {
    "tera": 12, "T": 12, "giga": 9, "G": 9, "mega": 6, "M": 6, "kilo": 3, "k": 3, "centi": -2, "c": -2,
    "milli": -3, "m": -3, "micro": -6, "u": -6, "µ": -6, "nano": -9, "n": -9, "pico": -12, "p": -12,
}  # fmt: skip
_BASE = {
    "m meter metre": "[length]", "s second sec": "[time]", "kg kilogram": "[mass]",
    "A ampere amp": "[current]", "rad radian": "[angle]",
    "K kelvin": "[temperature]", "degC celsius C": "[celsius]",
    "count counts cnt cts inc increment": "[count]",  # no angle: its revolution is another key
    "cpr Cpr CPR cpt CPT ppr PPR ppt PPT p pulse Pulse": "[pulse]",  # of one maker a line, of another a count
}  # fmt: skip
# What each is, in units that stand above it.
_DERIVED = {
    "percent": ("0.01", "1"), "ppm": ("0.000001", "1"), "g gram gm": ("0.001", "kg"),
    "in inch inches": ("0.0254", "m"), "ft foot": ("0.3048", "m"), "lb lbm pound": ("0.45359237", "kg"),
    "mil": ("0.0000254", "m"), "micron": ("0.000001", "m"), "oz ounce": ("0.028349523125", "kg"),
    "min minute": ("60", "s"), "h hour": ("3600", "s"), "N newton": ("1", "kg*m/s^2"),
    "lbf pound_force": ("4.4482216152605", "N"), "slug": ("1", "lbf*s^2/ft"),
    "ozf ounce_force": ("0.27801385095378125", "N"), "kgf kp kilogram_force": ("9.80665", "N"),
    "gf gram_force": ("0.00980665", "N"), "dyn dyne": ("0.00001", "N"), "J joule": ("1", "N*m"),
    "Nm newton_meter": ("1", "N*m"), "Ncm": ("0.01", "N*m"), "Nmm": ("0.001", "N*m"), "Nms": ("1", "N*m*s"),
    "Ns": ("1", "N*s"), "ozin": ("1", "ozf*in"), "lbin inlb": ("1", "lbf*in"), "lbft ftlb": ("1", "lbf*ft"),
    "kgcm": ("1", "kgf*cm"), "kgfm": ("1", "kgf*m"), "kgfcm": ("1", "kgf*cm"), "W watt": ("1", "J/s"),
    "V volt": ("1", "W/A"), "ohm Ω Ohm": ("1", "V/A"), "H henry henries Henry Henries": ("1", "V*s/A"),
    "F farad": ("1", "A*s/V"), "Vs": ("1", "V*s"), "As": ("1", "A*s"),
    "deg degree": ("0.017453292519943295", "rad"), "arcmin arcminute": ("0.0002908882086657216", "rad"),
    "arcsec arcsecond": ("4.84813681109536e-06", "rad"), "rev turn revolution": ("6.283185307179586", "rad"),
    "rpm RPM": ("0.10471975511965977", "rad/s"), "KV Kv": ("0.10471975511965977", "rad/(V*s)"),
    "Hz hertz": ("6.283185307179586", "rad/s"),
    "line": ("4", "count"),  # of an encoder: two edges of two tracks
}  # fmt: skip
_FLUX = (
    'is of a flux linkage psi: with motor.constants = "peak-phase" and p pole pairs back_emf_constant is '
    "p psi in V*s/rad, torque_constant 1.5 p psi in N*m/A"
)
# What makers write into a unit that is none, and what is to be written instead.
_ASIDE = {
    "erpm": 'is electrical; over the pole pairs it is "rpm"',
    "phase": 'is no unit; leave it out: with motor.constants = "peak-phase" R and L are of a phase, with '
    '"rms-line" line-line, twice those of a phase, with "dc" of a stepper those of a phase',
    "grad": 'is no unit; of 360 a turn it is "deg", of 400 "0.9 deg"',
    "g": "is no unit; 1 g of a fall is 9.80665 m/s^2",
    "line_line": "is no unit; leave it out: R and L are so, or of a phase, half, as motor.constants says",
    **dict.fromkeys(
        ("tick", "ticks", "sample", "samples", "cycle", "cycles", "period", "periods", "ts"),
        "is no unit; every takes ticks of control.period without one, a time is so many of that period",
    ),
    **dict.fromkeys(("wb", "mwb", "weber"), _FLUX),
    **dict.fromkeys(("step", "steps", "edges"), 'of an encoder are written "counts"'),
    **dict.fromkeys(("wr", "wk"), "is no unit; WR2 and WK2 are the inertia J, in kg*m^2 or lb*ft^2"),
    "degf": "is no unit here; F degrees Fahrenheit are (F - 32)/1.8 degC",
    "tpi": "is no lead; write one over it, in inches",
    "ipm": 'is written "in/min"',
    "db": "is no unit here; a ratio is 10^(dB/20): -20 dB is 0.1",
}
_WORD = 4  # letters from which a name may stand in the plural: "volts", but "As" is no unit
_PLURALS = ("sec", "min", "rev", "amp", "ohm", "Ohm", "mil", "lb")
_NO_PREFIX = ("kg", "kilogram", "gm")  # "kgm" is no mass
_NEVER_MEGA = ("rad", "s", "m", "in")  # "Grad" are degrees, "Ts" periods, "Mm", "Gm", "Min" mm, g, min
_COUNTS: Dimension = (("[count]", 1),)
_MINUTE = "[minute]"  # counted beside the time: without an angle it is that of a revolution per minute

_AMPERE = re.compile(r"\bA\b")
MOST_FACTORS = 40
_GD2 = re.compile(r"\s*\(?\b[GP]D(?:\^?2|²)\)?(?! ?/)\s*[=:]?\s*", re.I)  # PD2 in the south of Europe
_INNER = re.compile(r"\(([^()]*)\)")
_FACTOR = re.compile(r"\s*([*/]?)\s*(_[0-9]+|[A-Za-z_µΩ]+|1(?:000)?(?![0-9.]))(?:\s*\^(-?[1-6]))?\s*")
_WEIGHTS = re.compile(r"\b(oz|lb)s?\b|\b(kg|g)m?(?=[* ]c?m\b)")
# Read as meant only where the unit wanted is no other: V/rad/s, %/degC.
_MEANT = (
    (_WEIGHTS, r"\1\2f"),
    (re.compile(r"/ *(rad|deg|rev|turn|mm|m|in|inch|ft) */ *(s|sec|min)\b(?!\^)"), r"/(\1/\2)"),
    (re.compile(r"\b(?:degC|C|celsius)\b"), "K"),
)

Dimension = tuple[tuple[str, int], ...]
Exact = tuple[Fraction, Counter[str]]  # a factor to SI, and exponents
Units = dict[str, Exact]


@dataclass(frozen=True)
class UnitValue:
    """A unit in SI: what to multiply by, its dimension with the angle counted, and the power of minutes."""

    factor: float
    dimension: Dimension
    minutes: int = 0

    @property
    def angle(self) -> int:
        return dict(self.dimension).get("[angle]", 0)

    def without_angle(self) -> Dimension:
        return tuple(item for item in self.dimension if item[0] != "[angle]")


def _product(text: str, units: Units) -> Exact:
    """Names with powers from left to right, what stands in parentheses first; IndexError where it is none."""
    for k in range(MOST_FACTORS):
        inner = _INNER.search(text)
        if inner is None:
            break
        name = f"_{k}"
        units = {**units, name: _product(inner[1], units)}
        text = f"{text[: inner.start()]} {name} {text[inner.end() :]}"
    factors = _FACTOR.findall(text)
    if _FACTOR.sub("", text) or factors[0][0] or len(factors) > MOST_FACTORS:
        raise IndexError
    size, powers = Fraction(1), Counter[str]()
    for sign, name, power in factors:
        one, dimension = _named(name, units)
        n = int(power or 1) * (-1 if sign == "/" else 1)
        size *= one**n
        powers.update({of: n * each for of, each in dimension.items()})
    return size, powers


@lru_cache(maxsize=1)
def _units() -> Units:
    units: Units = {one: (Fraction(one), Counter()) for one in ("1", "1000")}
    for names, dimension in _BASE.items():
        units |= dict.fromkeys(names.split(), (Fraction(1), Counter({dimension: 1})))
    for names, (number, definition) in _DERIVED.items():
        factor, powers = _product(definition, units)
        units |= dict.fromkeys(names.split(), (Fraction(number) * factor, powers))
    return units | dict.fromkeys(("min", "minute"), (Fraction(60), units["min"][1] + Counter({_MINUTE: 1})))


def _named(name: str, units: Units) -> Exact:
    for one in (name, name.removesuffix("s")):
        plural = one != name
        for prefix, power in (("", 0), *_PREFIXES.items()):
            unit = one[len(prefix) :]
            if not one.startswith(prefix) or unit not in units:
                continue
            if (power and unit in _NO_PREFIX) or (power > 3 and unit in _NEVER_MEGA):
                continue
            if plural and not (len(unit) >= _WORD or unit in _PLURALS):
                continue
            factor, powers = units[unit]
            return factor * Fraction(10) ** power, powers
    raise ValueError(_unknown(name, units))


@lru_cache(maxsize=512)
def parse_unit(unit: str) -> UnitValue:
    """Read a unit such as ``"N*m/A"``; a ValueError if it is none, with the nearest known one."""
    if len(unit) > LONGEST:
        raise ValueError("a unit of more than 120 characters")
    if unit.strip() in ("", "1"):
        return UnitValue(1.0, ())
    try:
        factor, powers = _product(tidy(unit), _units())
    except IndexError:
        raise ValueError(f"{shown(unit)} is not a unit") from None
    dimension = tuple(sorted((name, n) for name, n in powers.items() if n and name != _MINUTE))
    size = 0.0
    with suppress(OverflowError):
        size = float(factor)
    if size == 0.0:
        raise ValueError(f"{shown(unit)} is beyond the range of floats")
    return UnitValue(size, dimension, powers[_MINUTE])


def _unknown(name: str, units: Units) -> str:
    if name.lower() in _ASIDE:
        return f'"{name.replace("_", "-")}" {_ASIDE[name.lower()]}'
    names = [known for known in units if known[0] != "1"]
    prefixed = (prefix + known for known in names for prefix in ("", *_PREFIXES))
    cased = [one for one in prefixed if one.lower() == name.lower() and one != name]
    cased.sort(key=lambda one: sum(map(ne, one, name)))  # of "mS" ms before Ms
    near = cased or get_close_matches(name, names, 1, 0.5)
    return f'unknown unit "{name}"' + (f' (nearest known: "{near[0]}")' if near else "")


def scaled(number: float, factor: float) -> float:
    """``number * factor``, rounded once where the factor is a whole fraction (milli, micro).

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
    "N*m^2": "flywheel effect, GD2 or WR2", "1": "ratio",
    "degC": "temperature", "K": "temperature difference", "pulse": "count or line, by maker",
}  # fmt: skip


@lru_cache(maxsize=1)
def _kinds() -> dict[Dimension, str]:
    return {parse_unit(unit).dimension: kind for unit, kind in _KINDS.items()}


def _kind_of(written: str, value: UnitValue) -> str:
    kind = _kinds().get(value.dimension)
    if kind is None:
        return f"has the dimension of {shown(written)}"
    return f"{shown(written)} is the unit of a{'n' if kind[0] in 'aeiou' else ''} {kind}"


_FREQUENCY = "speed or angular frequency"
_OVER_KM = "such a gain over kM, and over the ratio squared where it is of the output, is one in amperes"
_IN_HZ = "a bandwidth is written in Hz or rad/s"
_ADVICE = {
    (_FREQUENCY, "s"): "a corner (PI, filter) of it is {corner:.4g} s, 1/(2 pi f), a period {period:.6g} s",
    **dict.fromkeys(product((_FREQUENCY, "gain or rate"), ("A*s/rad", "V*s/rad", "V/A")), _IN_HZ),
    ("stiffness", "A/rad"): _OVER_KM,
    ("count or line, by maker", "1"): 'write "{n:.15g} lines" ({lines:.15g} counts) or "{n:.15g} counts"',
    (_FREQUENCY, "1/s"): "a frequency in Hz becomes a gain in 1/s times 2 pi: {size:.6g} 1/s",
    ("ratio", "A"): "of the motor's rated current it is {size:.4g} times that many amperes",
    ("mass", "m/s^2"): "1 g of a fall is 9.80665 m/s^2{fall}",
    ("mass", "N"): "a weight is written kgf",
    ("moment of inertia", "kg*m^2"): "GD2 is 4 J: J = {quarter:.4g} kg*m^2",
    ("flywheel effect, GD2 or WR2", "kg*m^2"): "GD2 is 4 g J, WR2 g J: of a GD2 J = {of_weight:.4g} kg*m^2",
    ("moment of inertia", "kg"): "a screw of lead p carries J as the mass J (2 pi/p)^2",
    ("mass", "kg*m^2"): "a mass m on a screw of lead p is the inertia m (p/2 pi)^2",
    ("torque", "N"): "a screw of lead p turns a torque T into the force 2 pi T/p",
}
"""Where engineers mix two up: what is written, the unit wanted, and how to get there."""


class AdvisedError(InputError):
    """A quantity of another dimension than was wanted, with how to get to that."""


def _advice(value: UnitValue, wanted: UnitValue, number: float) -> str:
    kind = _kinds().get(value.dimension)
    advices = (said for (one, unit), said in _ADVICE.items()
               if one == kind and parse_unit(unit).dimension == wanted.dimension)  # fmt: skip
    if (said := next(advices, None)) is not None:
        size = number * value.factor
        if "{corner" in said and size <= 0.0:
            return ""
        corner = 1.0 / size if size else 0.0
        here = {"n": number, "lines": 4.0 * number, "corner": corner, "period": 2.0 * pi * corner,
                "quarter": 0.25 * size, "of_weight": 0.25 * size / 9.80665}  # fmt: skip
        fall = f", here {9.80665 * number:.6g} m/s^2" if value.factor == 1e-3 else ""
        return f"; {said.format(size=size, fall=fall, **here)}"
    if "[count]" in dict(value.dimension) and wanted.angle:
        return "; write rad or rev for the counts: one is 2 pi/counts_per_rev rad"
    lacks = value.angle == 0 < wanted.angle and value.dimension == wanted.without_angle() != ()
    return "; write rev or rad into it, whichever is meant" if lacks else ""


def compatible(value: UnitValue, wanted: UnitValue) -> bool:
    """Whether a unit may stand for another; a radian in the denominator may be left out."""
    if value.dimension == wanted.dimension or (value.dimension, wanted.dimension) == (_COUNTS, ()):
        return True
    return wanted.angle < 0 and value.angle == 0 and value.without_angle() == wanted.without_angle()


def _as_meant(written: str, wanted: UnitValue) -> UnitValue:
    """A unit, as data sheets mean it where another one is wanted.

    Minutes without an angle are those of a speed in revolutions per minute (``mV/(1/min)``); ounces, pounds
    and kilograms are weights where no mass is wanted (``oz-in``, ``lb-in-s2``, ``kg-cm``); a speed may lack
    its brackets (``V/rad/s``); a difference of temperatures may be in degC (``degC/W``).
    """
    value = parse_unit(written)
    if value.minutes and wanted.angle and not value.angle:
        turns = -value.minutes
        dimension = tuple(sorted((*value.dimension, ("[angle]", turns))))
        value = UnitValue(value.factor * (2.0 * pi) ** turns, dimension)
    for spelling, meant in _MEANT:
        if not compatible(value, wanted) and spelling.search(tidy(written)):
            other = parse_unit(spelling.sub(meant, tidy(written)))
            value = other if compatible(other, wanted) else value
    return value


def parse_quantity(text: str | float | int, unit: str) -> float:
    """The SI value of a written quantity such as ``"6 uH"``, whose dimension must be that of ``unit``.

    A bare number stands for itself only where ``unit``, an SI unit without prefix, is dimensionless.
    An InputError if it is no number, not finite, has an unknown unit or the wrong dimension.

    >>> parse_quantity("9.2 g*cm^2", "kg*m^2")
    9.2e-07
    >>> round(parse_quantity("9000 rpm", "rad/s"), 3)
    942.478
    """
    wanted = parse_unit(unit)
    example = f"a number with a unit like {unit}" if unit not in ("", "1") else "a number without a unit"
    flywheel = isinstance(text, str) and _GD2.search(text) is not None
    try:
        plain = isinstance(text, int | float)
        number, written = (float(text), "") if plain else split_quantity(_GD2.sub("", f"{text}"))
        if not isfinite(number):
            raise ValueError("must be finite")
        result = _as_meant(written, wanted)
    except (ValueError, OverflowError) as error:
        raise InputError(f"{error}; allowed: {example}") from None
    if number == 0.0 and not written and "[celsius]" not in dict(wanted.dimension):
        return 0.0
    if not isfinite(value := scaled(number, result.factor)):
        raise InputError(f"must be finite; allowed: {example}")
    if flywheel or not compatible(result, wanted):
        wrong = f"wrong dimension, {_kind_of(written, result)}" if written else "has no unit"
        advice = _advice(result, wanted, number) if written else ""
        kind = AdvisedError if advice else InputError
        raise kind(f"{'a GD2' if flywheel else wrong}; allowed: {example}{advice}")
    return value


def si_text(value: float, unit: str) -> str:
    """A value in its own SI unit as text.

    >>> si_text(0.06, "ohm"), si_text(66.0, "1")
    ('0.06 ohm', '66.0')
    """
    return repr(value) if unit == "1" else f"{value!r} {unit}"


def ampere_unit(path: str, unit: str, constants: str) -> str:
    """The unit of a limit or gain as a file has to say it: of an AC motor (``constants``), which amperes.

    >>> ampere_unit("limits.peak_current", "A", "rms-line"), ampere_unit("limits.peak_current", "A", "dc")
    ('A dc', 'A')
    """
    several = constants != "dc" and path.startswith(("limits.", "control.", "duty."))
    return _AMPERE.sub("A dc", unit) if several else unit


def parse_limit(text: str | float | int, unit: str) -> float:
    """A limit as written, in the unit in which its quantity is reported.

    >>> parse_limit("6 dB", "dB"), parse_limit("90 rpm", "Hz")
    (6.0, 1.5)
    """
    try:
        number, written = split_quantity(str(text))
    except ValueError as error:
        raise InputError(f"{error}; allowed: a number with a unit like {unit}") from None
    if written == unit:
        return number
    if written == "dB":
        raise InputError(f"wrong dimension, a ratio in decibels; allowed: a number with a unit like {unit}")
    if unit == "dB":
        raise InputError('allowed: a number in dB such as "6 dB"')
    return parse_quantity(text, unit) / parse_unit(unit).factor
