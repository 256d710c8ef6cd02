"""What dry friction does at small signals: threshold, hysteresis, standing error, limit cycles."""

from actuator_lti.start.on_first_use import on_first_use

_ROOMS = dict.fromkeys(("FrictionEffects", "friction_effects"), f"{__name__}.result")
__getattr__, __dir__ = on_first_use(__name__, _ROOMS)
