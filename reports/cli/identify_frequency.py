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
    from actuator_lti.design.model import Design
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


def bench(folder: Path, name: str, drive: Design, seed: int, force: bool, as_json: bool) -> None:
    """Write the records of a simulated bench of a compliant drive, and say what to do with them."""

    from analyses.virtual_bench_files import write_record
    from analyses.virtual_bench_plan import plan_for
    from analyses.virtual_bench_two_mass import reversal_record, sweep_record
    from reports.cli.output import print_json, print_line
    from reports.cli.targets import refuse_existing

    plan = plan_for(drive)
    paths = {"sweep": folder / "sweep.csv"}
    refuse_existing(paths["sweep"], force)
    write_record(paths["sweep"], sweep_record(drive, plan, seed=seed))
    assert drive.coupling is not None
    if drive.coupling.play_rad > 0.0:
        paths["reversal"] = folder / "reversal.csv"
        write_record(paths["reversal"], reversal_record(drive, plan, seed=seed))
    if as_json:
        files = {key: str(path) for key, path in paths.items()}
        print_json({"files": files, "seed": seed, "plan": asdict(plan)})
        return
    play = f" --play {paths['reversal']}" if "reversal" in paths else ""
    print_line(
        f"{len(paths)} records written: lines every {1.0 / plan.period_s:.3g} Hz to {plan.highest_hz:.4g} Hz "
        f"at {plan.speed_rad_s:.3g} rad/s against {plan.moment_Nm:.3g} N m; next: actuator-lti identify "
        f"--frequency-response {paths['sweep']}{play} --design {name}"
    )


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
