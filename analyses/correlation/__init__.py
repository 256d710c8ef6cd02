"""The model against measured records: what it says for the record's own command, and how far off it is."""

from analyses.correlation.closed_loop import CorrelationResult, correlate_record
from analyses.correlation.compare import SignalComparison, compare_signals

__all__ = ["CorrelationResult", "SignalComparison", "compare_signals", "correlate_record"]
