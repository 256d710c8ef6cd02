"""Gains from requirements: rules inside out, refined on the exact sampled loops over tolerance corners."""

from actuator_lti.start.on_first_use import on_first_use

_ROOMS = {"TuningSettings": f"{__name__}.asked"}
_ROOMS |= dict.fromkeys(("BindingRequirement", "TuningResult"), f"{__name__}.result")
_ROOMS |= {"tune": f"{__name__}.run"}
__getattr__, __dir__ = on_first_use(__name__, _ROOMS)
