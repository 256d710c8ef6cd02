"""What is known of one key of a design file, and how its unit follows from the kind of drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import inf, isfinite
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

Axis = Literal["rotary", "linear"]
Kind = Literal[
    "quantity", "integer", "quantities", "matrix", "choice", "names", "flag", "text", "label", "day", "limit"
]  # fmt: skip

BIG = 1e12
SMALL = 1e-18
MANY = 12  # choices, from which on they are not listed
_WORDS = {"flag": "true or false", "text": "text", "label": "a text", "day": "a day, YYYY-MM-DD"}
_AXES: dict[str, dict[str, str]] = {
    "rotary": {"angle": "rad", "torque": "N*m", "inertia": "kg*m^2"},
    "linear": {"angle": "m", "torque": "N", "inertia": "kg"},
}


def unit_on(axis: Axis, template: str) -> str:
    """An SI unit on this kind of axis: ``"{angle}/s"`` is rad/s or m/s."""
    return template.format(**_AXES[axis])


@dataclass(frozen=True)
class Structure:
    """What decides the units of the gains: the axis, and which inner loops there are."""

    axis: Axis = "rotary"
    has_velocity: bool = True
    has_current: bool = True

    @classmethod
    def of(cls, design: Design) -> Structure:
        control = design.controller
        return cls(design.axis, control.velocity is not None, control.current is not None)


@dataclass(frozen=True, kw_only=True)
class Field:
    """One key of the design file."""

    path: str
    kind: Kind
    description: str
    attribute: str = ""
    unit_template: str = ""  # in SI, of {angle}, {torque}, {inertia} as the axis is, and {drive}, A or V
    symbol: str = ""
    low: float = -inf  # inclusive, in SI
    high: float = inf
    choices: tuple[str, ...] = ()
    required: bool = False
    example: str = ""
    most: Callable[[Design], tuple[float, str]] | None = None  # in a design, where others decide it, and why
    default: Any = None  # that of the attribute

    @property
    def is_number(self) -> bool:
        return self.kind in ("quantity", "integer")

    @property
    def section(self) -> str:
        return self.path.rpartition(".")[0]

    @property
    def key(self) -> str:
        return self.path.rpartition(".")[2]

    def unit(self, structure: Structure) -> str:
        """The SI unit of this key in a drive of this structure; ``"1"`` is dimensionless."""
        if self.path == "control.position.gain" and structure.has_velocity:
            return "1/s"
        template = self.unit_template.replace("{drive}", "A" if structure.has_current else "V")
        unit = unit_on(structure.axis, template)
        return "1" if unit == "rad/rad" else unit

    def travel_power(self) -> int:
        """n, where a value in rotary units becomes one in linear units times p^n, p the travel per radian.

        >>> from actuator_lti.design.fields import FIELDS
        >>> FIELDS["motor.rotor_inertia"].travel_power(), FIELDS["limits.speed"].travel_power()
        (-2, 1)
        """
        above, _, below = self.unit_template.partition("/")
        return sum(
            power * (above.count(word) - below.count(word))
            for word, power in (("{angle}", 1), ("{torque}", -1), ("{inertia}", -2))
        )

    def allowed(self, unit: str) -> str:
        if self.kind in _WORDS:
            return _WORDS[self.kind]
        if len(self.choices) > MANY:
            return f"one of {len(self.choices)}, see Requirement quantities in the documentation"
        if self.choices:
            return " or ".join(f'"{choice}"' for choice in self.choices)
        shown = "" if unit == "1" else f" {unit}"
        if self.low == SMALL:
            return f"above 0, {self.low:g} to {self.high:g}{shown}"
        low = "" if self.low == -inf else f"at least {self.low:g}{shown}"
        low = f"0, or at least {SMALL:g}{shown}" if self._zero_or_more else low
        high = "" if self.high == inf else f"at most {self.high:g}{shown}"
        return " and ".join(part for part in (low, high) if part) or "any finite number"

    def accepts(self, value: float) -> bool:
        """Whether an SI value lies in the allowed range; NaN does not, nor what is next to zero."""
        return self.low <= value <= self.high and not (self._zero_or_more and 0.0 < value < SMALL)

    def fits(self, value: Any) -> bool:
        """Whether an attribute of this key may have a value; any text and truth may stand for one."""
        listed = self.kind in ("quantities", "matrix", "names")
        return listed == isinstance(value, tuple | list) and self._fits_one(value)

    def _fits_one(self, value: Any) -> bool:
        if isinstance(value, tuple | list):  # a row of a matrix
            return all(map(self._fits_one, value))
        if self.kind in ("choice", "names"):
            return value in self.choices
        if self.kind in ("quantity", "integer", "quantities", "matrix"):
            number = isinstance(value, Real) and not isinstance(value, bool) and isfinite(value)
            return number and self.accepts(float(value)) and (self.kind != "integer" or value == int(value))
        return True

    @property
    def _zero_or_more(self) -> bool:
        return self.kind in ("quantity", "quantities") and self.low == 0.0


# --- a part of a design declares a key so: ``resistance_ohm: Annotated[type, positive(words, symbol)]`` ---
_UNITS = {
    "_kgm2": "{inertia}", "_Nms_rad": "{torque}*s/{angle}", "_Nm_rad": "{torque}/{angle}",
    "_Nm_A": "{torque}/A", "_Nm_V": "{torque}/V", "_Nm": "{torque}", "_Vs_rad": "V*s/{angle}",
    "_rad_s3": "{angle}/s^3", "_rad_s2": "{angle}/s^2", "_rad_s": "{angle}/s", "_rad": "{angle}",
    "_V_A": "V/A", "_K_W": "K/W", "_A_s": "A/s", "_per_K": "1/K", "_degC": "degC", "_ohm": "ohm",
    "_kg": "kg", "_H": "H", "_F": "F", "_V": "V", "_A": "A", "_s": "s", "_m": "m",
}  # fmt: skip
"""What an attribute's name ends with that has this unit: the longest that fits; none is dimensionless."""


def named_after(field: Field, attribute: str) -> Field:
    """The key of an attribute: its name without the unit, and that unit, where the key says no other."""
    suffix = max((one for one in _UNITS if attribute.endswith(one)), key=len, default="")
    unit = _UNITS[suffix] if suffix else "1"
    path, unit = field.path or attribute.removesuffix(suffix), field.unit_template or unit
    return replace(field, path=path, unit_template=unit, attribute=attribute)


def _field(kind: Kind, words: str, symbol: str = "", *, key: str = "", unit: str = "", **more: Any) -> Field:
    return Field(path=key, kind=kind, unit_template=unit, symbol=symbol, description=words, **more)


quantity = partial(_field, "quantity", low=-BIG, high=BIG)
"""Any finite number; ``key`` and ``unit`` where they are not those of the attribute's name."""
positive = partial(quantity, low=SMALL)  # a number above 0
not_negative = partial(quantity, low=0.0)  # a number of at least 0
quantities = partial(_field, "quantities", low=-BIG, high=BIG)  # a list of numbers
matrix = partial(_field, "matrix", low=-BIG, high=BIG)  # rows of as many numbers each
names = partial(_field, "names")  # some words, those of the attribute's type, each once
flag = partial(_field, "flag")  # true or false
text, label = partial(_field, "text"), partial(_field, "label")  # any text; one that is not empty
day, limit = partial(_field, "day"), partial(_field, "limit")
"""A date; a limit of a requirement, in the unit of its quantity."""


def degrees(words: str, example: str) -> Field:
    return quantity(words, low=-273.15, high=1000.0, example=example)


def integer(words: str, high: int, symbol: str = "", low: int = 1) -> Field:
    return _field("integer", words, symbol, low=low, high=high)


def choice(words: str, choices: tuple[str, ...] = ()) -> Field:
    """One of some words: those of the attribute's type, or fewer."""
    return _field("choice", words, choices=choices)
