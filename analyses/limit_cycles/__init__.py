"""Limit cycles of play and of a quantised position sensor: predicted by describing function, then sought."""

from actuator_lti.start.on_first_use import from_rooms

__getattr__, __dir__ = from_rooms(__name__, describing="Cycle", run="CycleResult LimitCycles limit_cycles")
