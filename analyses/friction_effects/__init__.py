"""What dry friction does at small signals: threshold, hysteresis, standing error, limit cycles."""

from actuator_lti.start.on_first_use import from_rooms

__getattr__, __dir__ = from_rooms(__name__, result="FrictionEffects friction_effects")
