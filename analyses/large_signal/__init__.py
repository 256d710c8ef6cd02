"""Large signals: where the linear model ends, what limits beyond, and what the output then looks like."""

from analyses.large_signal.result import LargeSignals, large_signals

__all__ = ["LargeSignals", "large_signals"]
