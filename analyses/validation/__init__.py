"""The validator: every linear prediction checked by the nonlinear simulator."""

from analyses.validation.result import Validation
from analyses.validation.settings import QUICK, Settings
from analyses.validation.validate import validate

__all__ = ["QUICK", "Settings", "Validation", "validate"]
