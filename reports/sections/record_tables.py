"""What went into an analysis of records: every column, and whether the record agrees with itself."""

from __future__ import annotations

from collections.abc import Sequence

from analyses.records.consistency import Finding
from analyses.records.inputs import InputUse
from reports import document as doc
from reports.document_schema import Block


def input_table(caption: str, inputs: Sequence[InputUse]) -> Block:
    """The columns of files: meaning, unit, range in SI, whether each is used and why not."""
    columns = [
        *([doc.of("file", "file", "File")] if any(one.file for one in inputs) else []),
        doc.of("column", "column", "Column"),
        doc.of("meaning", "meaning", "Meaning"),
        doc.of("unit", "unit", "Unit read"),
        doc.of("low", "low", "From", format="sig:4"),
        doc.of("high", "high", "to", format="sig:4"),
        doc.of("si", "si", "in"),
        doc.of("use", "use", "Used"),
    ]
    return doc.listing(caption, inputs, columns, status=lambda one: None if one.is_used else "warn")


def finding_table(record: str, findings: Sequence[Finding]) -> Block:
    """Whether a record agrees with itself and with the design's limits."""
    words = {True: "yes", False: "NO", None: "not told"}
    columns = [
        doc.of("subject", "subject", "Looked at"),
        doc.of(lambda one: words[one.passed], "state", "Agrees"),
        doc.of("text", "text", "Found"),
    ]
    return doc.listing(
        f"Does {record} agree with itself and the design?", findings, columns,
        status=lambda one: "info" if one.passed is None else "pass" if one.passed else "fail",
    )  # fmt: skip
