"""What every file of controller settings is held to, whichever kind it is."""

from __future__ import annotations

from typing import Any

from actuator_lti.design.model import ControllerObject, ControllerObjects
from actuator_lti.design.objects import check_objects
from actuator_lti.errors import InputError
from actuator_lti.reading import shown

MAX_OBJECTS = 5000


def checked_factor(factor: Any, where: str) -> float:
    """The calibration factor of the velocity gain, finite and positive."""
    if isinstance(factor, bool) or not isinstance(factor, int | float) or not 1e-6 <= factor <= 1e6:
        raise InputError(
            f"velocity_gain_factor = {shown(factor)}: allowed: 1 (per rad/s) or 9.549 (per rpm)", where=where
        )
    return float(factor)


def checked_objects(values: tuple[ControllerObject, ...], factor: Any, where: str) -> ControllerObjects:
    """Settings from their parts, each in its range."""
    if len(values) > MAX_OBJECTS:
        raise InputError(f"{len(values)} objects; allowed: at most {MAX_OBJECTS}", where=where)
    check_objects(values, where)
    return ControllerObjects(velocity_gain_factor=checked_factor(factor, where), values=values)
