"""Gains from requirements: rules inside out, refined on the exact sampled loops over tolerance corners."""

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
from analyses.tuning.run import TuningSettings, tune

__all__ = [
    "ELEMENTS",
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
