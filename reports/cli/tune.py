"""`actuator-lti tune`: gains from requirements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reports.cli.drive import SetOption, load_drive
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption, OutOption, QuietOption

if TYPE_CHECKING:
    from analyses.tuning import TuningResult

RequireOption = Annotated[
    list[str] | None,
    typer.Option("--require", metavar="LOOP.QUANTITY>=LIMIT",
                 help='In place of that of the design: "position.bandwidth>=30 Hz"; repeatable.'),
]  # fmt: skip
RoundOption = Annotated[
    bool, typer.Option("--round/--no-round", help="Round to the steps of the motion controller's objects.")
]
CurveOption = Annotated[bool, typer.Option("--curve/--no-curve", help="Trade-off curve.")]

_SUBTITLE = "Gains from requirements, over all corners of the tolerances, on the exact sampled loops."


def tune(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    require: RequireOption = None,
    rounded: RoundOption = True,
    curve: CurveOption = True,
    out: OutOption = Path("out/tune"),
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Find gains that meet the requirements at every corner of the tolerances, or say by how much none can.

    Writes tuned.toml (a design), tune.html and tune.json. Exit status 1 where the requirements cannot be met.
    """
    from analyses.tuning import TuningSettings
    from analyses.tuning import tune as tuned
    from analyses.tuning.asked_requirement import read_requirement
    from reports.cli.errors import leave_with
    from reports.cli.progress import progress

    drive = load_drive(design, changes)
    wanted = tuple(read_requirement(words, drive) for words in require or [])
    with progress(f"tuning {drive.name}", quiet=quiet) as shown:
        result = tuned(drive, TuningSettings(wanted, rounded, curve), progress=shown)
    _written(result, out, as_json, quiet)
    leave_with(result.feasible)


def _written(result: TuningResult, out: Path, as_json: bool, quiet: bool) -> None:
    """Write page, JSON and the tuned design; print the tables."""
    from actuator_lti.atomic import write_text
    from actuator_lti.design import write_design
    from reports.cli.output import print_json, print_line
    from reports.cli.progress import progress
    from reports.sections import tuning
    from reports.study_pages import study_document, write_pages
    from reports.terminal import print_blocks, print_verdict

    part = tuning.section(result)
    title = f"{result.before.title or result.before.name}: tuning"
    made = study_document(result.design, [part], title=title, subtitle=_SUBTITLE, kind="tuning")
    with progress("drawing figures", quiet=quiet) as drawing:
        page, data = write_pages(made, out, "tune", progress=drawing)
    file = out / "tuned.toml"
    write_text(file, write_design(result.design))
    if as_json:
        print_json(made)
        return
    print_verdict(result.feasible, f"{result.before.name}: {part['result']}")
    keys = ("path", "unit", "before", "rounded", "object", "steps", "object_unit")
    table = tuning.gains(result)
    short = {**table, "columns": [c for c in table["columns"] if c["key"] in keys]}
    print_blocks([short, tuning.requirements(result), tuning.checks(result)], list(result.notes))
    print_line(f"{page}\n{data}\n{file}")
