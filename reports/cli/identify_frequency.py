"""`actuator-lti identify --frequency-response`: a compliant two-mass drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from actuator_lti.tree import Tree
from reports.cli.drive import load_drive
from reports.cli.identify_common import Common, finish, fixed_values, say

if TYPE_CHECKING:
    from analyses.identification.frequency_bench import FrequencyResult


def run(paths: Sequence[Path], play: Path | None, period_s: float | None, common: Common) -> None:
    """Identify from a frequency response, print or write the result, end with the verdict's status."""
    from actuator_lti.errors import InputError
    from analyses.identification.frequency_bench import identify_frequency
    from analyses.records import open_record
    from reports.cli.errors import leave_with
    from reports.cli.output import print_json
    from reports.sections import frequency_identification as pages

    if len(paths) != 1:
        raise InputError("--frequency-response takes one record (and --play RECORD for the play)")
    drive = load_drive(common.design or "ilr33-amber", common.changes)
    result = identify_frequency(
        drive,
        open_record(paths[0]),
        play_record=None if play is None else open_record(play),
        period_s=period_s,
        fixed=fixed_values(drive, common.fixed),
    )
    made = pages.section(result)
    written = finish(common, drive, result.design, result.text, made, result.items)
    if common.as_json:
        print_json(as_data(result, written))
    else:
        say(made, written, result.items)
    leave_with(result.passed)


def as_data(result: FrequencyResult, written: Path | None) -> Tree:
    """The result as plain data, in SI."""

    from reports.identification_json import inputs_json, items_json
    from reports.sections.frequency_identification import values_of

    return {
        "record": result.record.name,
        "period_s": result.period_s,
        "lines": result.fit.lines,
        "misfit": result.fit.misfit,
        "values": {
            label: {"value": value, "standard_error": std, "unit": unit}
            for label, unit, value, std in values_of(result)
        },
        "play": None if result.play is None else asdict(result.play),
        "inputs": inputs_json(result.record, result.used),
        "findings": {name: [asdict(one) for one in outcome] for name, outcome in result.findings.items()},
        "checks": items_json(result.items),
        "passed": result.passed,
        "design": None if written is None else str(written),
    }
