"""Monte Carlo over the tolerances of a design: distributions, odds of every requirement, worst cases."""

from actuator_lti.start.on_first_use import on_first_use

_ROOMS = dict.fromkeys(("MonteCarloResult", "Odds"), f"{__name__}.result")
_ROOMS |= dict.fromkeys(("MonteCarloSettings", "monte_carlo"), f"{__name__}.run")
_ROOMS |= dict.fromkeys(("SampleTask", "StepCheck", "replay"), f"{__name__}.task")
__getattr__, __dir__ = on_first_use(__name__, _ROOMS)
