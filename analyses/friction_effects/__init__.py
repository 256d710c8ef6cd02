"""What dry friction does at small signals: threshold, hysteresis, standing error, limit cycles."""

from analyses.friction_effects.result import FrictionEffects, friction_effects

__all__ = ["FrictionEffects", "friction_effects"]
