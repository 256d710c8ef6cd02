"""Gains from requirements: rules inside out, refined on the exact sampled loops over tolerance corners."""

from actuator_lti.start.on_first_use import from_rooms

__getattr__, __dir__ = from_rooms(
    __name__, asked="TuningSettings", result="BindingRequirement TuningResult", run="tune"
)
