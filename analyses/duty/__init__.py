"""A duty cycle against the continuous current: rms, overload protection, winding temperature."""

from actuator_lti.start.on_first_use import on_first_use

_ROOMS = {"Asked": f"{__name__}.asked"}
_ROOMS |= dict.fromkeys(("Duty", "Heating", "Overload", "duty"), f"{__name__}.run")
__getattr__, __dir__ = on_first_use(__name__, _ROOMS)
