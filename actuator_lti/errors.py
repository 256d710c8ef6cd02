"""The ways in which a calculation is refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from math import isfinite
from numbers import Integral
from reprlib import Repr
from typing import Any

LONGEST = 1000  # characters of a refusal; what stands in a file may be longer

CHECKED = "by the function that takes it, which says what is allowed"  # in an `Annotated`


class InputError(ValueError):
    """Bad input: one line that names the place, the key, the value and what is allowed.

    ``where``: the file (and line) or the argument that holds it; put in front of the message.

    Examples
    --------
    >>> str(InputError("motor.resistance = -1 ohm: must be positive", where="my.toml"))
    'my.toml: motor.resistance = -1 ohm: must be positive'
    """

    def __init__(self, message: str, where: str | None = None) -> None:
        line = " ".join((f"{where}: {message}" if where else message).split())
        line = line if len(line) <= LONGEST else f"{line[: LONGEST - 3]}..."
        super().__init__("".join(c if c.isprintable() else "?" for c in line))
        self.message = message
        self.where = where


@contextmanager
def in_file(where: str) -> Iterator[None]:
    """Name the file of what is refused inside, where nothing nearer has been named."""
    try:
        yield
    except InputError as error:
        raise error if error.where else InputError(error.message, where=where) from None


class Mistakes(InputError):
    """Several mistakes of one file, in its order, each on a line of its own as its `InputError` has it."""

    def __init__(self, mistakes: Sequence[InputError]) -> None:
        super().__init__(mistakes[0].message, mistakes[0].where)
        self.mistakes = tuple(mistakes)

    def __str__(self) -> str:
        return "\n".join(map(str, self.mistakes))

    def __reduce__(self) -> tuple[type[Mistakes], tuple[tuple[InputError, ...]]]:
        return Mistakes, (self.mistakes,)


def as_one(errors: Sequence[InputError]) -> InputError:
    """One refusal of at least one: itself, or all in their order."""
    return errors[0] if len(errors) == 1 else Mistakes(errors)


class UnstableError(InputError):
    """A question that only a stable closed loop answers; the input is sound, the drive fails (status 1)."""


class NumericalError(ArithmeticError):
    """A calculation that could not be finished to its stated accuracy; the message says what to try."""


class OutOfTime(Exception):
    """The stated time of a command is over: it ends the command, whatever a part does about refusals."""


class TooManyTicks(NumericalError):
    """Runs that would take longer than anybody waits for; nothing has been computed."""


def finite_number(
    name: str, value: Any, allowed: str = "a finite number, in SI", holds: Callable[[float], bool] = isfinite
) -> float:
    """An argument that is one finite real number that ``holds``; else refused with what is allowed.

    >>> finite_number("load_Nm", "4 N*m")
    Traceback (most recent call last):
    actuator_lti.errors.InputError: load_Nm = '4 N*m': must be a finite number, in SI
    """
    try:
        number = float("nan" if isinstance(value, str | bytes | bool) else value)
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not (isfinite(number) and holds(number)):
        raise InputError(f"{name} = {shown(value)}: must be {allowed}")
    return number


def positive_number(name: str, value: Any) -> float:
    return finite_number(name, value, "positive and finite, in SI", lambda number: number > 0.0)


def delay_number(delay_s: Any) -> float:
    return finite_number("delay_s", delay_s, "finite and not negative, in s", lambda number: number >= 0.0)


def whole_number(name: str, value: Any, least: int = 1) -> int:
    """An argument that is a whole number from ``least`` on.

    >>> whole_number("cycles", 2.5)
    Traceback (most recent call last):
    actuator_lti.errors.InputError: cycles = 2.5: must be a whole number, at least 1
    """
    if not isinstance(value, Integral) or value < least:
        raise InputError(f"{name} = {shown(value)}: must be a whole number, at least {least}")
    return int(value)


_SHORT = Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 100


def shown(value: Any) -> str:
    """What was given instead, for one line: the ends of what is long."""
    try:
        return str(value) if isinstance(value, float) else _SHORT.repr(value)
    except ValueError:
        return "a number of more digits than Python writes"
