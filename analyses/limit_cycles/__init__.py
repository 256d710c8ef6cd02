"""Limit cycles of play and of a quantised position sensor: predicted by describing function, then sought."""

from actuator_lti.start.on_first_use import on_first_use

_ROOMS = {"Cycle": f"{__name__}.describing"}
_ROOMS |= dict.fromkeys(("Confirmation", "LimitCycles", "limit_cycles"), f"{__name__}.run")
__getattr__, __dir__ = on_first_use(__name__, _ROOMS)
