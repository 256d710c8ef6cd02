"""The drive at its corners: hot, cold, low supply, and the worst ends of its tolerances."""

from actuator_lti.start.on_first_use import on_first_use

_ROOMS = {"Asked": f"{__name__}.asked"}
_ROOMS |= dict.fromkeys(("Corner", "Corners", "corners"), f"{__name__}.run")
__getattr__, __dir__ = on_first_use(__name__, _ROOMS)
