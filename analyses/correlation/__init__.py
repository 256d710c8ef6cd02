"""The model against measured records: what it says for the record's own command, and how far off it is."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.correlation.asked import Asked
    from analyses.correlation.closed_loop import CorrelationResult, correlate_record
    from analyses.correlation.compare import SignalComparison, compare_signals
    from analyses.correlation.run import Correlation, correlate
    from analyses.correlation.summary import SignalSummary, summarise, worst_of

__all__ = [
    "Asked",
    "Correlation",
    "CorrelationResult",
    "SignalComparison",
    "SignalSummary",
    "compare_signals",
    "correlate",
    "correlate_record",
    "summarise",
    "worst_of",
]

_ROOMS = {
    "asked": ("Asked",),
    "closed_loop": ("CorrelationResult", "correlate_record"),
    "compare": ("SignalComparison", "compare_signals"),
    "run": ("Correlation", "correlate"),
    "summary": ("SignalSummary", "summarise", "worst_of"),
}
__getattr__, __dir__ = on_first_use(
    __name__, {name: f"{__name__}.{room}" for room, names in _ROOMS.items() for name in names}
)
