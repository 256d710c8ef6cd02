"""How the row of a run follows from the keys of its design, found by running `design_row` on traced values.

Arithmetic on a traced value is written down.  Where the program looks at one (a comparison, a floor),
the outcome is written down as a condition: other values that meet all conditions give the same program.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from actuator_lti.design.access import located, parameter_value, paths_of, stacked
from actuator_lti.design.field import Structure
from actuator_lti.design.model import Design
from nonlinear._kernels import layout as at
from nonlinear.export.statement import Statement, used
from nonlinear.row.parameters import design_row


@dataclass
class Tape:
    """Statements in the order in which they were made."""

    interpreted: bool = False  # a whole number below a value, a comparison's outcome: values, not conditions
    loose: bool = False  # a message may show a value, a remainder is one, and every value is finite
    statements: list[Statement] = field(default_factory=list)
    count: int = 0

    def value(self, does: str, terms: tuple[Any, ...], number: float) -> Traced:
        self.count += 1
        self._note("value", self.count, does, terms)
        return Traced(self, f"v{self.count}", number)

    def condition(self, does: str, terms: tuple[Any, ...], outcome: bool) -> bool:
        self._note("condition", int(outcome), does, terms)
        return outcome

    def _note(
        self, kind: Literal["value", "condition"], target: int, does: str, terms: tuple[Any, ...]
    ) -> None:
        named = (each.name if isinstance(each, Traced) else float(each) for each in terms)
        self.statements.append(Statement(kind, target, does, tuple(named)))


def _number(value: Any) -> float:
    return value.number if isinstance(value, Traced) else float(value)


def _binary(sign: str, function: Callable[[Any, Any], Any], *, loose: bool = False) -> tuple[Any, Any]:
    def made(tape: Tape, one: Any, other: Any) -> Traced:
        if loose and not tape.loose:
            raise TypeError(f"{sign} of a traced value")
        return tape.value(sign, (one, other), function(_number(one), _number(other)))

    def forward(self: Traced, other: Any) -> Traced:
        if isinstance(other, np.ndarray):
            return NotImplemented  # numpy goes over its elements
        return made(self.tape, self, other)

    def backward(self: Traced, other: Any) -> Traced:
        return made(self.tape, other, self)

    return forward, backward


def _compared(sign: str, function: Callable[[Any, Any], bool]) -> Any:
    def compare(self: Traced, other: Any) -> Any:
        if not isinstance(other, int | float | Traced):
            return False
        if self.tape.loose and isinstance(other, float) and math.isinf(other):
            return function(self.number, other)
        made = self.tape.value if self.tape.interpreted else self.tape.condition
        return made(sign, (self, other), function(self.number, _number(other)))

    return compare


def _function(name: str) -> Any:
    def function(self: Traced) -> Traced:
        return self.tape.value(name, (self,), getattr(math, name)(self.number))

    return function


def _rounded(name: str) -> Any:
    def rounded(self: Traced) -> Any:
        result = float(getattr(math, name)(self.number))
        made = self.tape.value(name, (self,), result)
        if self.tape.interpreted:
            return made
        self.tape.condition("==", (made, result), True)
        return np.float64(result)

    return rounded


class Traced:
    """A number that remembers how it was made."""

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, tape: Tape, name: str, number: float) -> None:
        self.tape, self.name, self.number = tape, name, number

    __add__, __radd__ = _binary("+", operator.add)
    __sub__, __rsub__ = _binary("-", operator.sub)
    __mul__, __rmul__ = _binary("*", operator.mul)
    __truediv__, __rtruediv__ = _binary("/", operator.truediv)
    __pow__, _ = _binary("pow", operator.pow)
    __mod__, __rmod__ = _binary("fmod", math.fmod, loose=True)
    __and__, _ = _binary("&&", lambda one, other: bool(one) and bool(other))  # of comparisons that are values
    __or__, _ = _binary("||", lambda one, other: bool(one) or bool(other))
    __rand__, __ror__ = __and__, __or__
    __lt__, __le__ = _compared("<", operator.lt), _compared("<=", operator.le)
    __gt__, __ge__ = _compared(">", operator.gt), _compared(">=", operator.ge)
    __eq__, __ne__ = _compared("==", operator.eq), _compared("!=", operator.ne)
    floor, ceil = _rounded("floor"), _rounded("ceil")  # numpy asks by these names
    __floor__, __ceil__ = floor, ceil
    tan, sqrt, sin, cos, exp, log = (_function(name) for name in ("tan", "sqrt", "sin", "cos", "exp", "log"))
    __abs__ = _function("fabs")

    def either(self, yes: Any, no: Any) -> Traced:
        """One value where this comparison holds, else the other."""
        return self.tape.value("where", (self, yes, no), _number(yes if self.number else no))

    def zero_below(self, least: Any) -> Traced:
        """The value, or 0 where its size is less."""
        if not self.tape.interpreted:
            return self if abs(self) >= least else self.tape.value("", (0.0,), 0.0)
        kept = self.number if abs(self.number) >= _number(least) else 0.0
        return self.tape.value("zero_below", (self, least), kept)

    def __format__(self, form: str) -> str:
        """Stands in a message for the value that it will have."""
        return f"\x01{form or 'g'}\x02{self.name}\x03"

    def __neg__(self) -> Traced:
        return self.tape.value("-", (self,), -self.number)

    def __bool__(self) -> bool:
        return self.tape.condition("!=", (self, 0.0), self.number != 0.0)

    def __float__(self) -> float:
        if self.tape.loose:
            return self.number
        raise TypeError("a function of a floating-point number")

    def __int__(self) -> int:
        raise TypeError("a whole number of a floating-point number")


@dataclass(frozen=True, kw_only=True)
class Key:
    """One numeric key of a design as a parameter, in SI."""

    path: str
    value: float
    unit: str
    description: str
    low: float
    high: float
    whole: bool = False  # a count
    fixed: bool = False  # only before the run begins, because the state's shape or clock depends on it


@dataclass(frozen=True)
class KeyTrace:
    """Keys that can be changed after the export, the rest, and the C statements from keys to the row."""

    keys: tuple[Key, ...]
    constants: tuple[Key, ...]
    lines: tuple[str, ...]


# what decides the clock, the shape of the state or its start: not to be changed during a run
_FIXED = {
    at.PERIOD, at.EVERY_VELOCITY, at.EVERY_POSITION, at.DELAY_TICKS, at.DELAY_FRACTION, at.RATIO,
    at.RATIO_TO_COUPLING, at.DIFFERENCE_SAMPLES, at.PROFILE_SAMPLES, at.COUNTS_PER_RAD,
    at.POSITION_COUNTS, at.OWN_COUNTS, at.OWN_OUTPUT_COUNTS, at.SEED,
}  # fmt: skip
LARGEST_INTEGER = 2**31 - 1  # of an integer variable
# an input of the drive; what the units of a file were turned by when it was read
_DECIDED = ("limits.voltage", "screw.lead")


def trace_keys(design: Design) -> KeyTrace:
    """Follow every numeric key of a design into its row."""
    free: list[Key] = []
    constants: list[Key] = []
    for path in paths_of(design):
        places = set() if path in _DECIDED else reached(design, path, Tape())
        (free if places else constants).append(_key(design, path, fixed=bool(places and places & _FIXED)))
    statements = row_statements(design, {key.path: key.value for key in free}, Tape())
    return KeyTrace(tuple(free), tuple(constants), tuple(each.c for each in statements))


def followed(design: Design, keys: Mapping[str, float], tape: Tape) -> Design:
    """The design whose keys, ``k[0]``, ``k[1]``, ... in their order, write down what is done with them."""
    values = {path: Traced(tape, f"k[{n}]", value) for n, (path, value) in enumerate(keys.items())}
    return stacked(design, values)


def row_statements(design: Design, keys: Mapping[str, float], tape: Tape) -> tuple[Statement, ...]:
    """The statements from keys to the row."""
    row = design_row(followed(design, keys, tape), kind=object)
    stored = [Statement("store", place, "", (row[place].name,)) for place in _traced(row)]
    return used([*tape.statements, *stored])


def reached(design: Design, path: str, tape: Tape) -> set[int] | None:
    """Places of the row that a key has an influence on; None where it cannot be followed."""
    try:
        changed = followed(design, {path: parameter_value(design, path)}, tape)
        return set(_traced(design_row(changed, kind=object)))
    except TypeError:
        return None


def _traced(row: Any) -> list[int]:
    return [place for place in range(row.size) if isinstance(row[place], Traced)]


def _key(design: Design, path: str, *, fixed: bool) -> Key:
    known, value = located(design, path)[0], parameter_value(design, path)
    return Key(
        path=path,
        value=value,
        unit=known.unit(Structure.of(design)),
        whole=known.kind == "integer" and value <= LARGEST_INTEGER,
        fixed=fixed,
        **{name: getattr(known, name) for name in ("description", "low", "high")},
    )
