"""Monte Carlo over the tolerances of a design: distributions, odds of every requirement, worst cases."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.monte_carlo.asked import Asked
    from analyses.monte_carlo.result import ColumnStatistics, Driver, MonteCarloResult, Odds, WorstCase
    from analyses.monte_carlo.run import MonteCarloSettings, monte_carlo, sample_folder
    from analyses.monte_carlo.task import SampleTask, StepCheck, replay

__all__ = [
    "Asked",
    "ColumnStatistics",
    "Driver",
    "MonteCarloResult",
    "MonteCarloSettings",
    "Odds",
    "SampleTask",
    "StepCheck",
    "WorstCase",
    "monte_carlo",
    "replay",
    "sample_folder",
]

_ROOMS = {"Asked": "asked", "SampleTask": "task", "StepCheck": "stepping", "replay": "task"}
_ROOMS |= dict.fromkeys(("ColumnStatistics", "Driver", "MonteCarloResult", "Odds", "WorstCase"), "result")
_ROOMS |= dict.fromkeys(("MonteCarloSettings", "monte_carlo", "sample_folder"), "run")
__getattr__, __dir__ = on_first_use(__name__, {name: f"{__name__}.{room}" for name, room in _ROOMS.items()})
