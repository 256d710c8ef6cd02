"""Arguments of public functions: one of another kind than its annotation says is refused in one line.

The package is what is public: a name taken from it looks at its arguments inside the house too; a
function taken from the module that defines it looks at nothing, unless that module is public itself
(`nonlinear.commands`). Methods look where they are marked.
"""

import sys
from collections.abc import Callable
from functools import wraps
from itertools import chain
from types import FunctionType
from typing import Any, TypeVar, cast

Made = TypeVar("Made", bound=type)
Checked = TypeVar("Checked", bound=Callable[..., Any])
_GUARDED = set[Callable[..., Any]]()


def asked(made: Made) -> Made:
    """A class of what is asked: a field of another kind is refused where it is made.

    >>> from dataclasses import dataclass
    >>> @asked
    ... @dataclass
    ... class Sheet:
    ...     width_m: float = 1.0
    >>> Sheet(2).width_m, Sheet("2 m")
    Traceback (most recent call last):
    actuator_lti.errors.InputError: width_m = '2 m': must be a number, in SI
    """
    made.__init__ = checks_arguments(made.__init__)  # type: ignore[misc]
    return made


def guard(room: str) -> None:
    """Guard all functions of a module's ``__all__``."""
    names = vars(sys.modules[room])
    names |= {name: guarded(names[name], room) for name in names["__all__"]}


def guarded(value: Any, room: str) -> Any:
    """A public name of a room; of a function one that first looks at its arguments."""
    if not isinstance(value, FunctionType) or value in _GUARDED:
        return value
    checked = checks_arguments(value)
    checked.__module__ = room  # where a pickle finds it
    _GUARDED.add(checked)
    return checked


def checks_arguments(made: Checked) -> Checked:
    """A function or method that first looks at its arguments."""
    names = made.__code__.co_varnames[: made.__code__.co_argcount]

    @wraps(made)
    def checked(*given: Any, **named: Any) -> Any:
        from actuator_lti.start.kinds import refuse_others  # with the first call: packages open at once

        refuse_others(made, chain(zip(names, given, strict=False), named.items()))
        return made(*given, **named)

    return cast(Checked, checked)
