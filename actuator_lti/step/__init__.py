"""Step response and its figures: rise, overshoot, settling."""

from actuator_lti.start.border import guard
from actuator_lti.step.figures import StepFigures, step_figures

__all__ = ["StepFigures", "step_figures"]

guard(__name__)
