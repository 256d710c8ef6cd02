"""Monte Carlo over the tolerances of a design: distributions, odds of every requirement, worst cases."""

from actuator_lti.start.on_first_use import from_rooms

__getattr__, __dir__ = from_rooms(
    __name__,
    result="MonteCarloResult Odds",
    run="MonteCarloSettings monte_carlo",
    task="SampleTask StepCheck replay",
)
