"""Monte Carlo over the tolerances of a design: distributions, odds of every requirement, worst cases."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.monte_carlo.result import MonteCarloResult, Odds
    from analyses.monte_carlo.run import MonteCarloSettings, monte_carlo
    from analyses.monte_carlo.task import SampleTask, StepCheck, replay

__all__ = [
    "MonteCarloResult", "MonteCarloSettings", "Odds", "SampleTask", "StepCheck", "monte_carlo", "replay",
]  # fmt: skip

_ROOMS = {"StepCheck": "task", "MonteCarloResult": "result", "Odds": "result"}
_ROOMS |= {"MonteCarloSettings": "run", "monte_carlo": "run", "SampleTask": "task", "replay": "task"}
__getattr__, __dir__ = on_first_use(__name__, {name: f"{__name__}.{room}" for name, room in _ROOMS.items()})
