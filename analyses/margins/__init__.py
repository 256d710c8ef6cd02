"""Margins, bandwidths and requirements of a design at one operating point, and their spread over all."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.margins.asked import Asked
    from analyses.margins.run import Margins, margins

__all__ = ["Asked", "Margins", "margins"]

_ROOMS = {"Asked": "asked", "Margins": "run", "margins": "run"}
__getattr__, __dir__ = on_first_use(__name__, {name: f"{__name__}.{room}" for name, room in _ROOMS.items()})
