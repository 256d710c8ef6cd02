"""Limit cycles of play and of a quantised position sensor: predicted by describing function, then sought."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.limit_cycles.result import Confirmation, Cycle, LimitCycles
    from analyses.limit_cycles.run import limit_cycles

__all__ = ["Confirmation", "Cycle", "LimitCycles", "limit_cycles"]

_ROOMS = {"Confirmation": "result", "Cycle": "result", "LimitCycles": "result", "limit_cycles": "run"}
__getattr__, __dir__ = on_first_use(__name__, {name: f"{__name__}.{room}" for name, room in _ROOMS.items()})
