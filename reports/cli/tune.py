"""`actuator-lti tune`: gains from requirements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from reports.cli.drive import SetOption, load_drive
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption, OutOption, QuietOption

if TYPE_CHECKING:
    from analyses.tuning import TuningResult

Aim = Literal["least-change", "reserve"]
RequireOption = Annotated[
    list[str] | None,
    typer.Option("--require", metavar="LOOP.QUANTITY>=LIMIT",
                 help='In place of that of the design: "position.bandwidth>=30 Hz"; repeatable.'),
]  # fmt: skip
RoundOption = Annotated[
    bool, typer.Option("--round/--no-round", help="Round to the steps of the motion controller's objects.")
]
AimOption = Annotated[
    Aim,
    typer.Option("--aim", help="The least change of the design that meets every requirement, "
                               "or the largest distance to all limits (up to 30 %)."),
]  # fmt: skip
PlaceOption = Annotated[
    list[str] | None,
    typer.Option("--place", metavar="ELEMENT,...",
                 help="What may be added where gains alone do not do: notch, lowpass, feedforward; "
                      "the fewest that do are kept."),
]  # fmt: skip
CurveOption = Annotated[bool, typer.Option("--curve/--no-curve", help="Trade-off curve.")]

_SUBTITLE = "Gains from requirements, over all corners of the tolerances, on the exact sampled loops."


def tune(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    require: RequireOption = None,
    aim: AimOption = "least-change",
    place: PlaceOption = None,
    rounded: RoundOption = True,
    curve: CurveOption = True,
    out: OutOption = Path("out/tune"),
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Find gains that meet the requirements at every corner of the tolerances, or say by how much none can.

    By default the least change of the design. With --place also a notch, a low-pass, feed-forward where gains
    alone do not do, as in

    actuator-lti tune joint --require "position.bandwidth>=60 Hz" --place notch,feedforward

    The result is confirmed by certified margins, nominal and at each requirement's worst corner.

    Writes tuned.toml (a design), tune.html and tune.json. Exit status 1 where the requirements cannot be met.
    """
    from analyses.tuning import TuningSettings
    from analyses.tuning import tune as tuned
    from analyses.tuning.asked_requirement import read_requirement
    from reports.cli.errors import leave_with
    from reports.cli.progress import progress

    drive = load_drive(design, changes)
    wanted = tuple(read_requirement(words, drive) for words in require or [])
    elements = tuple(word.strip() for words in place or [] for word in words.split(","))
    settings = TuningSettings(wanted, rounded, curve, aim=aim, place=elements)
    with progress(f"tuning {drive.name}", quiet=quiet) as shown:
        result = tuned(drive, settings, progress=shown)
    _written(result, out, as_json, quiet)
    leave_with(result.feasible)


def _written(result: TuningResult, out: Path, as_json: bool, quiet: bool) -> None:
    """Write page, JSON and the tuned design; print the tables."""
    from actuator_lti.atomic import write_text
    from actuator_lti.design import write_design
    from reports.cli.output import print_json, print_line
    from reports.cli.progress import progress
    from reports.document import with_columns
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
    print_blocks(
        [with_columns(table, keys), tuning.requirements(result), tuning.checks(result)], list(result.notes)
    )
    print_line(f"{page}\n{data}\n{file}")
