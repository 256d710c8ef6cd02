"""One motion of the nonlinear drive, as a command line asks for it."""

from actuator_lti.start.on_first_use import on_first_use

_ROOMS = {"Asked": f"{__name__}.asked"}
_ROOMS |= dict.fromkeys(("Motion", "motion"), f"{__name__}.run")
__getattr__, __dir__ = on_first_use(__name__, _ROOMS)
