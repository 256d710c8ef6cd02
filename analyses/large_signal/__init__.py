"""Large signals: where the linear model ends, what limits beyond, and what the output then looks like."""

from actuator_lti.start.on_first_use import on_first_use

_ROOMS = dict.fromkeys(("LargeSignals", "large_signals"), f"{__name__}.result")
__getattr__, __dir__ = on_first_use(__name__, _ROOMS)
