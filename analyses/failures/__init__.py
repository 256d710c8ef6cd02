"""What a drive does when a part of it fails: deflection, current and moment over time."""

from actuator_lti.start.on_first_use import on_first_use

_ROOMS = {"Asked": f"{__name__}.asked"}
_ROOMS |= dict.fromkeys(("FailureCase", "Failures", "failures"), f"{__name__}.run")
__getattr__, __dir__ = on_first_use(__name__, _ROOMS)
