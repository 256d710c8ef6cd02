"""`actuator-lti identify A.csv B.csv`: records of a motion, together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_lti.tree import Tree
from reports.cli.drive import load_drive
from reports.cli.identify_common import Common, finish, fixed_values, say

if TYPE_CHECKING:
    from analyses.identification.bench import BenchResult


def run(paths: Sequence[Path], unseen: Sequence[Path], common: Common, options: Mapping[str, Any]) -> None:
    """Identify from records, print or write the result, and end with the verdict's status."""
    from analyses.identification.bench import BenchSettings, identify_bench
    from analyses.records import open_record
    from analyses.records.record import named_apart
    from reports.cli.errors import leave_with
    from reports.cli.output import print_json
    from reports.cli.progress import progress
    from reports.sections import dynamic_identification as pages

    drive = load_drive(common.design or "emps", common.changes)
    settings = BenchSettings(
        fixed=fixed_values(drive, common.fixed), residual_limit=common.residual_limit, **options
    )
    records = named_apart([open_record(path) for path in paths])
    held_out = named_apart([open_record(path) for path in unseen], [r.name for r in records])
    with progress("identifying", quiet=common.quiet) as bar:
        result = identify_bench(drive, records, validation=held_out, settings=settings, progress=bar)
    made = pages.section(result, drive.axis)
    written = finish(common, drive, result.design, result.text, made, result.items)
    if common.as_json:
        print_json(as_data(result, written))
    else:
        say(made, written, result.items)
    leave_with(result.passed)


def as_data(result: BenchResult, written: Path | None) -> Tree:
    """The result as plain data, in SI."""

    from reports.identification_json import inputs_json, items_json

    model, refined = result.model, result.refined
    deviations = model.covariance.diagonal() ** 0.5
    values = zip(model.names, model.values, model.standard_errors, deviations, strict=True)
    return {
        "record": result.records[0].name,
        "rows_in": sum(record.counts.rows_in for record in result.records),
        "rows_out": sum(record.counts.rows_out for record in result.records),
        "parameters": {
            n: {
                "value": v,
                "standard_error": s,
                "standard_error_correlated": d,
                "between_records": model.between[n],
                "bias_removed": model.bias.get(n),
            }
            for n, v, s, d in values
        },
        "electrical": None if result.electrical is None else asdict(result.electrical),
        "laws": [asdict(law) for law in result.laws],
        "fixed": {name: asdict(one) for name, one in model.fixed.items()},
        "bias": model.bias_told,
        "covariance": model.covariance,
        "relative_residual": model.relative_residual,
        "records": [
            {
                "name": part.name,
                "relative_residual": part.relative_residual,
                "rows_in": part.rows_in,
                "rows_used": part.rows_used,
                "inputs": inputs_json(record, part.used),
                "findings": [asdict(one) for one in result.findings[record.name]],
            }
            for part, record in zip(model.records, result.records, strict=True)
        ],
        "validation": [
            {"name": record.name, "findings": [asdict(one) for one in result.findings[record.name]]}
            for record in result.validation
        ],
        "written_design_against": [asdict(one) for one in result.resimulated],
        "refined": None if refined is None else dict(refined.values),
        "refined_standard_errors": None if refined is None else dict(refined.standard_errors),
        "checks": items_json(result.items),
        "passed": result.passed,
        "design": None if written is None else str(written),
    }
