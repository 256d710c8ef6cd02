"""Step response and its figures: rise, overshoot, settling."""

from actuator_lti.start.public_arguments import guard
from actuator_lti.step.figures import StepFigures, step_figures

__all__ = ["StepFigures", "step_figures"]

guard(__name__)
