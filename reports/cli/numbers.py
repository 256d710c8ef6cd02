"""Numbers on the command line: finite, and whole ones of 64 bits, whatever the option."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

from actuator_lti.errors import InputError

_WHOLE_BITS = 63


def bounded(command: Any) -> Any:
    """Let every option and argument of a command, and of those below it, refuse numbers beyond this."""
    for parameter in command.params:
        parameter.process_value = _checked(parameter, parameter.process_value)
    for below in getattr(command, "commands", {}).values():
        bounded(below)
    return command


def _checked(parameter: Any, cast: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    name = max(parameter.opts, key=len)

    def checked(context: Any, value: Any) -> Any:
        result = cast(context, value)
        for each in result if isinstance(result, list | tuple) else (result,):
            if isinstance(each, float) and not isfinite(each):
                raise InputError(f"{name} {each}: must be a finite number")
            if isinstance(each, int) and each.bit_length() > _WHOLE_BITS:
                raise InputError(f"{name}: must lie between -2^63 and 2^63")
        return result

    return checked
