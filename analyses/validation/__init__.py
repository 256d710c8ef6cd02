"""The validator: every linear prediction checked by the nonlinear simulator."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import from_rooms

if TYPE_CHECKING:  # a module has the same name
    from analyses.validation.validate import validate as validate

__getattr__, __dir__ = from_rooms(
    __name__, result="Validation", settings="Asked CHECKS QUICK Settings", validate="validate"
)
