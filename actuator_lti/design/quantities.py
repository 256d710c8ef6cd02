"""The figures that a requirement may limit, and the unit in which each is reported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from actuator_lti.design.model import Axis
from actuator_lti.design.units import convert, parse_quantity, parse_unit, split_quantity
from actuator_lti.errors import InputError


@dataclass(frozen=True)
class Quantity:
    """A figure of merit: its name, its unit in reports (linear axis: other), and whether of a loop."""

    name: str
    unit: str
    scope: Literal["loop", "drive"]
    description: str
    linear_unit: str = ""

    def unit_for(self, axis: Axis) -> str:
        """The unit in which this figure is reported."""
        return self.linear_unit if axis == "linear" and self.linear_unit else self.unit


_LIST = (
    Quantity("gain_margin", "dB", "loop", "smallest gain margin, up or down"),
    Quantity("phase_margin", "deg", "loop", "smallest phase margin"),
    Quantity("delay_margin", "s", "loop", "smallest delay margin"),
    Quantity("modulus_margin", "1", "loop", "smallest distance of L from -1"),
    Quantity("sensitivity_peak", "dB", "loop", "peak of |S|"),
    Quantity("bandwidth", "Hz", "loop", "closed loop -3 dB"),
    Quantity("bandwidth_90deg", "Hz", "loop", "closed loop -90 deg"),
    Quantity("resonance_peak", "dB", "loop", "peak of |T| over its value at DC"),
    Quantity("overshoot", "%", "loop", "of the step of the closed loop"),
    Quantity("rise_time", "s", "loop", "10 % to 90 %"),
    Quantity("settling_time", "s", "loop", "to within 2 %"),
    Quantity("output_rate", "deg/s", "drive", "largest speed of the output at a load", "m/s"),
    Quantity("motor_current", "A", "drive", "motor current at top speed and a load"),
    Quantity("acceleration", "deg/s^2", "drive", "largest acceleration of the output at a load", "m/s^2"),
)

QUANTITIES: dict[str, Quantity] = {quantity.name: quantity for quantity in _LIST}
"""Every quantity that a requirement may name."""


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
    return {"deg": "rad", "Hz": "rad/s", "deg/s": "rad/s", "deg/s^2": "rad/s^2"}[unit]


def _decibel(text: str | float | int) -> float:
    try:
        number, written = split_quantity(str(text))
    except ValueError as error:
        raise InputError(f"{error}; allowed: a number in dB") from None
    if written != "dB":
        raise InputError('allowed: a number in dB such as "6 dB"')
    return number


def write_limit(value: float, unit: str) -> str | float:
    """A limit as text (a plain number where dimensionless) that :func:`parse_limit` reads back."""
    return value if unit == "1" else f"{value!r} {unit}"
