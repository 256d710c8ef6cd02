"""One key of a design at several values."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from os import PathLike
from typing import Any

from actuator_lti.design.loader import as_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown


@dataclass(frozen=True)
class SweepPoint:
    """A value of the key as it was given, and the design that has it."""

    value: Any
    design: Design


def sweep(design: Design | str | PathLike[str], path: str, values: Iterable[Any]) -> tuple[SweepPoint, ...]:
    """Designs that differ in one key.

    Parameters
    ----------
    design : Design, str or path
        A design, a shipped name, or the path of a design file.
    path : str
        Dotted key, such as ``"limits.voltage"``.
    values : iterable
        Texts with their unit (``"14 V"``), or numbers in SI.

    Returns
    -------
    tuple of SweepPoint
        In the order of the values.

    Raises
    ------
    InputError
        For an unknown key, a wrong unit, or a value that is not allowed.

    Examples
    --------
    >>> result = sweep("ilr33-amber", "limits.voltage", ["12 V", 14.0])
    >>> [(at.value, at.design.limits.voltage_V) for at in result]
    [('12 V', 12.0), (14.0, 14.0)]
    """
    base = as_design(design)
    if not isinstance(values, Iterable):
        raise InputError(f"values = {shown(values)}: allowed: several, such as [12.0, 14.0]")
    return tuple(SweepPoint(value, base.with_values({path: value})) for value in values)
