"""Margins of a single loop: every crossover, both ways to stability, modulus and disk margin.

`engine` asks, `results` answers. In double precision: `loop`, its factors (`factored`) and their compiled
search (`axis_search`, `axis_parts`; behind a delay up to its `tail`), what it does `along` the axis, all
together in `checked`. What that cannot check: `exact` for rational loops, `delays` for exact delays; data of
a measurement: `measured`.
"""

from actuator_lti.margins.engine import stability_margins
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement, DelayMargin, DiskMargin, GainMargin, PhaseMargin
from actuator_lti.measured.response import MeasuredResponse
from actuator_lti.start.public_arguments import guard

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

guard(__name__)
