"""One motion of the nonlinear drive, as a command line asks for it."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.motion.asked import Asked
    from analyses.motion.run import Motion, motion

__all__ = ["Asked", "Motion", "motion"]

_ROOMS = {"Asked": "asked", "Motion": "run", "motion": "run"}
__getattr__, __dir__ = on_first_use(__name__, {name: f"{__name__}.{room}" for name, room in _ROOMS.items()})
