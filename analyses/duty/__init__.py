"""A duty cycle against the continuous current: rms, overload protection, winding temperature."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.duty.asked import Asked
    from analyses.duty.run import Duty, Heating, Overload, duty

__all__ = ["Asked", "Duty", "Heating", "Overload", "duty"]

_ROOMS = {"Asked": "asked", "Duty": "run", "Heating": "run", "Overload": "run", "duty": "run"}
__getattr__, __dir__ = on_first_use(__name__, {name: f"{__name__}.{room}" for name, room in _ROOMS.items()})
