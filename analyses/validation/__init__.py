"""The validator: every linear prediction checked by the nonlinear simulator."""

from analyses.validation.result import Validation
from analyses.validation.settings import CHECKS, QUICK, Settings
from analyses.validation.validate import validate

__all__ = ["CHECKS", "QUICK", "Settings", "Validation", "validate"]
