"""Numbers on the command line: finite, and whole ones of 64 bits, whatever the option."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

import typer

_WHOLE_BITS = 63


def bounded(command: Any) -> Any:
    """Let every option and argument of a command, and of those below it, refuse numbers beyond this."""
    for parameter in command.params:
        parameter.process_value = _checked(parameter, parameter.process_value)
    for below in getattr(command, "commands", {}).values():
        bounded(below)
    return command


def _checked(parameter: Any, cast: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def checked(context: Any, value: Any) -> Any:
        result = cast(context, value)
        for each in result if isinstance(result, list | tuple) else (result,):
            if isinstance(each, float) and not isfinite(each):
                raise typer.BadParameter(f"{each}: must be a finite number", ctx=context, param=parameter)
            if isinstance(each, int) and each.bit_length() > _WHOLE_BITS:
                raise typer.BadParameter("must lie between -2^63 and 2^63", ctx=context, param=parameter)
        return result

    return checked
