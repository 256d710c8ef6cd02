"""The model against measured records: what it says for the record's own command, and how far off it is."""

from analyses.correlation.closed_loop import CorrelationResult, correlate_record
from analyses.correlation.compare import SignalComparison, compare_signals
from analyses.correlation.summary import SignalSummary, summarise, worst_of

__all__ = [
    "CorrelationResult",
    "SignalComparison",
    "SignalSummary",
    "compare_signals",
    "correlate_record",
    "summarise",
    "worst_of",
]
