"""The validator: every linear prediction checked by the nonlinear simulator."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.validation.result import Validation
    from analyses.validation.settings import CHECKS, QUICK, Asked, Settings
    from analyses.validation.validate import validate

__all__ = ["CHECKS", "QUICK", "Asked", "Settings", "Validation", "validate"]

_ROOMS = {"Validation": "result", "validate": "validate"}
_ROOMS |= dict.fromkeys(("Asked", "CHECKS", "QUICK", "Settings"), "settings")
__getattr__, __dir__ = on_first_use(__name__, {name: f"{__name__}.{room}" for name, room in _ROOMS.items()})
