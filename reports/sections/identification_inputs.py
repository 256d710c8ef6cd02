"""What went into an analysis of records: every column, and whether the record agrees with itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from analyses.records.naming import MEANINGS
from reports import document as doc
from reports.document_schema import Block, Cell, Column, Row

if TYPE_CHECKING:
    from analyses.correlation.closed_loop import CorrelationResult
    from analyses.identification.campaign import CampaignResult
    from analyses.identification.verdict import Item
    from analyses.records.consistency import Finding
    from analyses.records.record import Record

NOT_USED = "not needed for this"


def input_rows(record: Record, used: Mapping[str, str]) -> list[Row]:
    """One row a column of the file: meaning, unit, range in SI, whether it is used and why not."""
    rows = []
    for one in record.inputs:
        row: Row = {"column": one.column, "unit": one.unit or "–"}
        if one.signal == "time":
            row |= _time(record) | {"use": "time"}
        elif one.signal in record.signals:
            values = record[one.signal]
            row |= {
                "meaning": MEANINGS.get(one.signal, one.signal),
                "low": float(np.min(values)),
                "high": float(np.max(values)),
                "si": record.units.get(one.signal, ""),
                "use": used.get(one.signal, f"no: {NOT_USED}"),
            }
            if one.signal not in used:
                row["_status"] = "warn"
        else:
            row |= {"meaning": "–", "use": f"no: {one.note or NOT_USED}", "_status": "warn"}
        if one.note and one.signal:
            row["use"] = f"{row['use']} ({one.note})"
        rows.append(row)
    return rows


def _time(record: Record) -> Row:
    return {
        "meaning": f"time, every {1e3 * record.period_s:.6g} ms",
        "low": float(record.time_s[0]),
        "high": float(record.time_s[-1]),
        "si": "s",
    }


def campaign_rows(result: CampaignResult) -> list[Row]:
    """One row a column of the runs' files, its range over all runs."""
    used = {
        "current": "torque kM i",
        "speed": "steady speed",
        "torque": "load",
        "angle": "check of the speed",
    }
    rows: dict[tuple[str, Cell], Row] = {}
    for run in result.imported.runs:
        for source, inputs in (("drive", run.record.inputs), ("sensor", run.sensor_inputs)):
            own = replace(run.record, inputs=inputs)
            for row in input_rows(own, used):
                key = (source, row["column"])
                if source == "sensor" and row["use"] == "time":
                    row = {"column": row["column"], "meaning": "time, on a clock of its own", "use": "time"}
                if key in rows and "low" not in rows[key] and "low" in row:
                    del rows[key]  # a run without load does not use the sensor
                known = rows.setdefault(key, {"file": source, **row})
                for side, pick in (("low", min), ("high", max)):
                    ends = [one[side] for one in (known, row) if side in one]
                    if ends:
                        known[side] = pick(end for end in ends if isinstance(end, float))
    return list(rows.values())


def campaign_table(result: CampaignResult) -> Block:
    """The columns of a campaign's files."""
    return _table("Inputs of all runs", campaign_rows(result), doc.column("file", "File"))


def input_table(record: Record, used: Mapping[str, str]) -> Block:
    """The columns of one record."""
    return _table(f"Inputs: {record.name}", input_rows(record, used))


def result_input_table(result: CorrelationResult) -> Block:
    """The columns of a record that a model was held against."""
    return input_table(result.source, result.used)


def _table(caption: str, rows: list[Row], *first: Column) -> Block:
    columns = [
        *first,
        doc.column("column", "Column"),
        doc.column("meaning", "Meaning"),
        doc.column("unit", "Unit read"),
        doc.column("low", "From", format="sig:4"),
        doc.column("high", "to", format="sig:4"),
        doc.column("si", "in"),
        doc.column("use", "Used"),
    ]
    return doc.table(caption, columns, rows)


def finding_table(record: str, findings: Sequence[Finding]) -> Block:
    """Whether a record agrees with itself and with the design's limits."""
    columns = [
        doc.column("subject", "Looked at"),
        doc.column("state", "Agrees"),
        doc.column("text", "Found"),
    ]
    words = {True: "yes", False: "NO", None: "not told"}
    status = {True: "pass", False: "fail", None: "info"}
    rows = [
        {"subject": f.subject, "state": words[f.passed], "text": f.text, "_status": status[f.passed]}
        for f in findings
    ]
    return doc.table(f"Does {record} agree with itself and the design?", columns, rows)


def verdict_words(items: Sequence[Item], result: str) -> str:
    """One sentence: what was found, or which checks fail and why."""
    wrong = [item for item in items if item.passed is False]
    if not wrong:
        return result
    first = wrong[0]
    why = f": {first.reason}" if first.reason else ""
    more = f" ({len(wrong) - 1} more of {len(items)} checks fail)" if len(wrong) > 1 else ""
    return f"{first.label} fails{why}{more}. {result}"


def verdict_block(items: Sequence[Item]) -> Block:
    """The verdict, item by item; shares in per cent."""
    made = []
    for item in items:
        value = None if item.value is None else 100.0 * item.value
        limit = None if item.limit is None else 100.0 * item.limit
        made.append(
            doc.verdict(
                item.id,
                item.label,
                value=value,
                limit=limit,
                unit="%" if value is not None else "",
                distance=None if value is None or limit is None else limit - value,
                passed=item.passed,
                reason=item.reason,
                comparison="<=" if limit is not None else "",
            )
        )
    return doc.verdicts(made, "bench checks")
