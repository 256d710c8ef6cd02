"""Large signals: where the linear model ends, what limits beyond, and what the output then looks like."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.large_signal.result import LargeSignals, large_signals

__all__ = ["LargeSignals", "large_signals"]

__getattr__, __dir__ = on_first_use(__name__, dict.fromkeys(__all__, f"{__name__}.result"))
