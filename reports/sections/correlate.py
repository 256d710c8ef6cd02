"""Records against the model: all together, then each; or a chirp predicted from steps."""

from __future__ import annotations

from analyses.correlation.run import Correlation, Prediction
from reports.document_schema import Section
from reports.sections import chirp, correlation


def section(result: Correlation | Prediction) -> list[Section]:
    """Make the sections."""
    if isinstance(result, Prediction):
        return [chirp.section(result.motor, result.chirp, result.record)]
    limit = result.limit
    made = [correlation.section(one, k, error_limit=limit) for k, one in enumerate(result.records, 1)]
    if len(made) > 1:
        made.insert(0, correlation.summary_section(result.records, error_limit=limit))
    return made
