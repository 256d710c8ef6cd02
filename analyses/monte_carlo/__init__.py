"""Monte Carlo over the tolerances of a design: distributions, odds of every requirement, worst cases."""

from analyses.monte_carlo.result import ColumnStatistics, MonteCarloResult, Odds, WorstCase
from analyses.monte_carlo.run import MonteCarloSettings, monte_carlo, sample_folder
from analyses.monte_carlo.task import SampleTask, StepCheck, replay

__all__ = [
    "ColumnStatistics",
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
