"""Gains from requirements: rules inside out, refined on the exact sampled loops over tolerance corners."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.tuning.asked import TuningSettings
    from analyses.tuning.result import BindingRequirement, TuningResult
    from analyses.tuning.run import tune

__all__ = ["BindingRequirement", "TuningResult", "TuningSettings", "tune"]

_ROOMS = {"BindingRequirement": "result", "TuningResult": "result", "TuningSettings": "asked", "tune": "run"}
__getattr__, __dir__ = on_first_use(__name__, {name: f"{__name__}.{room}" for name, room in _ROOMS.items()})
