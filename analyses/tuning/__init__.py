"""Gains from requirements: rules inside out, refined on the exact sampled loops over tolerance corners."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.tuning.asked import Asked, TuningSettings
    from analyses.tuning.placing import ELEMENTS
    from analyses.tuning.result import BindingRequirement, GainSetting, TradeOffPoint, TuningResult
    from analyses.tuning.rules import (
        RuleGains,
        integrator_gain,
        magnitude_optimum,
        pi_for_crossover,
        rule_gains,
        symmetric_optimum,
    )
    from analyses.tuning.run import tune

__all__ = [
    "ELEMENTS",
    "Asked",
    "BindingRequirement",
    "GainSetting",
    "RuleGains",
    "TradeOffPoint",
    "TuningResult",
    "TuningSettings",
    "integrator_gain",
    "magnitude_optimum",
    "pi_for_crossover",
    "rule_gains",
    "symmetric_optimum",
    "tune",
]

_ROOMS = {
    "Asked": "asked",
    "BindingRequirement": "result",
    "ELEMENTS": "placing",
    "GainSetting": "result",
    "RuleGains": "rules",
    "TradeOffPoint": "result",
    "TuningResult": "result",
    "TuningSettings": "asked",
    "integrator_gain": "rules",
    "magnitude_optimum": "rules",
    "pi_for_crossover": "rules",
    "rule_gains": "rules",
    "symmetric_optimum": "rules",
    "tune": "run",
}
__getattr__, __dir__ = on_first_use(__name__, {name: f"{__name__}.{room}" for name, room in _ROOMS.items()})
