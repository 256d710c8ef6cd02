"""What went into an analysis of records: every column, and whether the record agrees with itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from reports import document as doc
from reports.document_schema import Block

if TYPE_CHECKING:
    from analyses.records.consistency import Finding
    from analyses.records.inputs import InputUse


def input_table(caption: str, inputs: Sequence[InputUse]) -> Block:
    """The columns of files: meaning, unit, range in SI, whether each is used and why not."""
    columns = [
        *([(doc.column("file", "File"), lambda one: one.file)] if any(one.file for one in inputs) else []),
        (doc.column("column", "Column"), lambda one: one.column),
        (doc.column("meaning", "Meaning"), lambda one: one.meaning),
        (doc.column("unit", "Unit read"), lambda one: one.unit),
        (doc.column("low", "From", format="sig:4"), lambda one: one.low),
        (doc.column("high", "to", format="sig:4"), lambda one: one.high),
        (doc.column("si", "in"), lambda one: one.si),
        (doc.column("use", "Used"), lambda one: one.use),
    ]
    return doc.listing(caption, inputs, columns, status=lambda one: None if one.is_used else "warn")


def finding_table(record: str, findings: Sequence[Finding]) -> Block:
    """Whether a record agrees with itself and with the design's limits."""
    words = {True: "yes", False: "NO", None: "not told"}
    columns = [
        (doc.column("subject", "Looked at"), lambda one: one.subject),
        (doc.column("state", "Agrees"), lambda one: words[one.passed]),
        (doc.column("text", "Found"), lambda one: one.text),
    ]
    return doc.listing(
        f"Does {record} agree with itself and the design?", findings, columns,
        status=lambda one: "info" if one.passed is None else "pass" if one.passed else "fail",
    )  # fmt: skip
