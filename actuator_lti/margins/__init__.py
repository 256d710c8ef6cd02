"""Margins of a single loop: every crossover, both ways to stability, modulus and disk margin."""

from actuator_lti.margins.engine import stability_margins
from actuator_lti.margins.measured_data import MeasuredResponse
from actuator_lti.margins.results import (
    Agreement,
    DelayMargin,
    DiskMargin,
    GainMargin,
    PhaseMargin,
    StabilityMargins,
)

__all__ = [
    "Agreement",
    "DelayMargin",
    "DiskMargin",
    "GainMargin",
    "MeasuredResponse",
    "PhaseMargin",
    "StabilityMargins",
    "stability_margins",
]
