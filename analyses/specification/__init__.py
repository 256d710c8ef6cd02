"""What a specification of an actuator asks for: rates, acceleration, current, duty, step times."""

from actuator_lti.start.public_arguments import guard
from analyses.specification.result import Specification, specification

__all__ = ["Specification", "specification"]

guard(__name__)
