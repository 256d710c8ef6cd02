"""Limit cycles of play and of a quantised position sensor: foreseen by describing function, then sought."""

from analyses.limit_cycles.result import Confirmation, Cycle, LimitCycles
from analyses.limit_cycles.run import limit_cycles

__all__ = ["Confirmation", "Cycle", "LimitCycles", "limit_cycles"]
