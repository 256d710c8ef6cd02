"""Records against the model: all together, then each."""

from __future__ import annotations

from analyses.correlation.run import Correlation
from reports.document_schema import Section
from reports.sections import correlation


def section(result: Correlation) -> list[Section]:
    """Make the sections."""
    limit = result.limit
    made = [correlation.section(one, k, error_limit=limit) for k, one in enumerate(result.records, 1)]
    if len(made) > 1:
        made.insert(0, correlation.summary_section(result.records, error_limit=limit))
    return made
