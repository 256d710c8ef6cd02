"""Large signals: where the linear model ends, what limits beyond, and what the output then looks like."""

from actuator_lti.start.on_first_use import from_rooms

__getattr__, __dir__ = from_rooms(__name__, result="LargeSignals large_signals")
