"""The ways in which a calculation is refused."""

from __future__ import annotations

from collections.abc import Sequence

LONGEST = 1000  # characters of a refusal; what stands in a file may be longer


class InputError(ValueError):
    """Bad input: one line that names the place, the key, the value and what is allowed.

    Parameters
    ----------
    message : str
        What is wrong and what is allowed, in one line.
    where : str, optional
        The file (and line) or the argument that holds it; put in front of the message.

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


class Mistakes(InputError):
    """Several mistakes of one file, each on a line of its own as its `InputError` has it.

    Attributes
    ----------
    mistakes : tuple of InputError
        At least two, in the order of the file.
    """

    def __init__(self, mistakes: Sequence[InputError]) -> None:
        super().__init__(mistakes[0].message, mistakes[0].where)
        self.mistakes = tuple(mistakes)

    def __str__(self) -> str:
        return "\n".join(map(str, self.mistakes))

    def __reduce__(self) -> tuple[type[Mistakes], tuple[tuple[InputError, ...]]]:
        return Mistakes, (self.mistakes,)


class UnstableError(InputError):
    """A question that only a stable closed loop answers; the input is sound, the drive fails (status 1)."""


class NumericalError(ArithmeticError):
    """A calculation that could not be finished to its stated accuracy; the message says what to try."""


class OutOfTime(Exception):
    """The stated time of a command is over: it ends the command, whatever a part does about refusals."""


class TooManyTicks(NumericalError):
    """Runs that would take longer than anybody waits for; nothing has been computed."""
