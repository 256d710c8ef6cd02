"""The drive at its corners: hot, cold, low supply, and the worst ends of its tolerances."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.corners.asked import Asked
    from analyses.corners.run import Corner, Corners, corners

__all__ = ["Asked", "Corner", "Corners", "corners"]

_ROOMS = {"Asked": "asked", "Corner": "run", "Corners": "run", "corners": "run"}
__getattr__, __dir__ = on_first_use(__name__, {name: f"{__name__}.{room}" for name, room in _ROOMS.items()})
