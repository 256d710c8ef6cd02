"""Records against the model: all together, then each; or a chirp predicted from steps."""

from __future__ import annotations

from dataclasses import asdict

from actuator_lti.tree import Tree
from analyses.correlation import CorrelationResult, summarise, worst_of
from analyses.correlation.run import Correlation, Prediction
from reports.as_json import as_json
from reports.document_schema import Section
from reports.sections import chirp, correlation

KEYS = (
    "unit", "samples", "relative_error", "fit_percent", "mean_error", "rms_error", "max_error",
    "max_error_time_s", "delay_s",
)  # fmt: skip


def section(result: Correlation | Prediction) -> list[Section]:
    """Make the sections."""
    if isinstance(result, Prediction):
        return [chirp.section(result.motor, result.chirp, result.record)]
    limit = result.limit
    made = [correlation.section(one, k, error_limit=limit) for k, one in enumerate(result.results, 1)]
    if len(made) > 1:
        made.insert(0, correlation.summary_section(result.results, error_limit=limit))
    return made


def data(result: Correlation | Prediction) -> Tree:
    """Everything but the curves."""
    if isinstance(result, Prediction):
        bands = [
            {"from_hz": a, "to_hz": b, "relative_error": c.relative_error} for a, b, c in result.chirp.bands
        ]
        return {
            "motor": asdict(result.motor),
            "chirp": asdict(result.chirp.law),
            "relative_error": result.chirp.whole.relative_error,
            "fit_percent": result.chirp.whole.fit_percent,
            "bands": bands,
        }
    return {
        "records": [_record(one) for one in result.results],
        "summary": {one.name: asdict(one) for one in summarise(result.results)},
        "worst": worst_of(result.results)[0].record,
        "passed": result.passed,
    }


def _record(result: CorrelationResult) -> Tree:
    return {
        "record": result.record,
        "sha256": result.sha256,
        "design": result.design,
        "rows": result.counts,
        "limits": result.limits,
        "notes": result.notes,
        "inputs": as_json(result.inputs),
        "findings": [asdict(finding) for finding in result.findings],
        "signals": {s.name: {key: getattr(s, key) for key in KEYS} for s in result.signals},
    }
