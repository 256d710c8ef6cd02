"""What dry friction does at small signals: threshold, hysteresis, standing error, limit cycles."""

from actuator_lti.start.on_first_use import on_first_use

__all__ = ["FrictionEffects", "friction_effects"]
__getattr__, __dir__ = on_first_use(__name__, dict.fromkeys(__all__, f"{__name__}.result"))
