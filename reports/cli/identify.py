"""`actuator-lti identify`: friction from a campaign, inertia and friction from records."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from reports.cli.drive import SetOption
from reports.cli.options import JsonOption, QuietOption
from reports.cli.targets import folder_for_results

FilesArgument = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="[FILE]...",
        help="A campaign file (TOML), or records: CSV, Parquet, .mat, record files (TOML). "
        "--example prints a campaign file.",
    ),
]
DynamicOption = Annotated[
    Path | None,
    typer.Option("--dynamic", metavar="RECORD", help="A record; the same as naming it as a FILE."),
]
ValidateOption = Annotated[
    list[Path] | None,
    typer.Option("--validate", metavar="RECORD", help="A record the fit does not see; repeatable."),
]
FixOption = Annotated[
    list[str] | None,
    typer.Option(
        "--fix",
        metavar="KEY=VALUE",
        help="Hold a value, such as friction.load_coefficient=0; repeatable.",
    ),
]
AcceptOption = Annotated[
    bool, typer.Option("--accept", help="Write the design even where a check fails (the status stays 1).")
]
LimitOption = Annotated[
    float,
    typer.Option(
        "--residual-limit",
        min=0.0,
        metavar="PERCENT",
        help="Largest relative residual for which a design is written.",
    ),
]
InertiaOption = Annotated[
    str,
    typer.Option(
        "--inertia-to",
        metavar="KEY",
        help="Where the inertia goes, less the design's others: motor.rotor_inertia or load.inertia.",
    ),
]
FrequencyOption = Annotated[
    bool,
    typer.Option(
        "--frequency-response", help="Of one record with a periodic excitation: a compliant two-mass drive."
    ),
]
PlayOption = Annotated[
    Path | None,
    typer.Option(
        "--play",
        metavar="RECORD",
        help="With --frequency-response: a reversing motion, both angles.",
    ),
]
PeriodOption = Annotated[
    float | None,
    typer.Option("--period", metavar="s", help="Period of the excitation (default: found from the command)."),
]
DesignOption = Annotated[
    str | None,
    typer.Option(
        "--design", metavar="DESIGN", help="Design by name or path (default: the campaign's, or emps)."
    ),
]
FrictionOption = Annotated[
    str,
    typer.Option(
        "--friction",
        metavar="FORM",
        help="Of records: symmetric, per-direction, or map (over the speed, where it is clearly better).",
    ),
]
GravityOption = Annotated[
    bool, typer.Option("--gravity", help="Of records: look for a pendulum at the output, m g l sin(angle).")
]
ElectricalOption = Annotated[
    bool,
    typer.Option("--electrical", help="Of records: R, kE and kM from u = R i + kE w first (L if it shows)."),
]
RefineOption = Annotated[
    bool,
    typer.Option("--refine", help="Of records: refine by simulation; the design gets the refined values."),
]
CutoffOption = Annotated[
    float | None,
    typer.Option(
        "--cutoff", metavar="Hz", help="Of records: low-pass cut-off (default 100, or 0.1 of the rate)."
    ),
]
DecimationOption = Annotated[
    int | None, typer.Option("--decimation", min=1, help="Of records: decimation (default: to the cut-off).")
]
SuggestOption = Annotated[
    int, typer.Option("--suggest", min=0, max=50, metavar="N", help="Suggest so many further runs.")
]
CriterionOption = Annotated[
    str, typer.Option("--criterion", metavar="NAME", help="What suggested runs serve: margins, or D.")
]
FolderOption = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        callback=folder_for_results,
        help="Write page, JSON and, where all checks pass, the identified design file there.",
    ),
]
ExampleOption = Annotated[
    bool, typer.Option("--example", help="Print a campaign file to start from, and stop.")
]


def identify(
    files: FilesArgument = None,
    dynamic: DynamicOption = None,
    validate: ValidateOption = None,
    frequency_response: FrequencyOption = False,
    play: PlayOption = None,
    period: PeriodOption = None,
    design: DesignOption = None,
    changes: SetOption = None,
    fix: FixOption = None,
    accept: AcceptOption = False,
    residual_limit: LimitOption = 20.0,
    inertia_to: InertiaOption = "motor.rotor_inertia",
    friction: FrictionOption = "symmetric",
    gravity: GravityOption = False,
    electrical: ElectricalOption = False,
    refine: RefineOption = False,
    cutoff: CutoffOption = None,
    decimation: DecimationOption = None,
    suggest: SuggestOption = 6,
    criterion: CriterionOption = "margins",
    out: FolderOption = None,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
    example: ExampleOption = False,
) -> None:
    """Identify a drive from bench records, and write the result as a design with
    tolerances.

    Three ways to call it:

    identify campaign.toml --out result: C0, Cv and CM from the steady parts
    of many runs. A bad run is set aside and named, the others go on.

    identify A.csv B.csv --validate C.csv --design my.toml: inertia, friction
    and offset from records of a motion together, by the inverse dynamic
    model; --refine simulates the drive as well. The EMPS benchmark's file is
    known as it is.

    identify --frequency-response chirp.csv --play reversal.csv --design my.toml:
    inertias, stiffness, damping and play of a two-mass drive.

    Every column of every file is accounted for. Each record is held against
    itself and against the design's limits, and the written design against the
    record that it came from. Where a check fails the status is 1, and no
    design is written without --accept.
    """
    from actuator_lti.errors import InputError
    from reports.cli import identify_campaign, identify_frequency, identify_records
    from reports.cli.identify_common import Common

    given = [*(files or []), *([dynamic] if dynamic is not None else [])]
    common = Common(
        design=design,
        fixed=tuple(fix or ()),
        accept=accept,
        residual_limit=residual_limit / 100.0,
        out=out,
        as_json=as_json,
        quiet=quiet,
        changes=tuple(changes or ()),
    )
    if friction not in ("symmetric", "per-direction", "map"):
        raise InputError(f"--friction {friction}: symmetric, per-direction or map")
    if example:
        _print_example()
    elif not given:
        raise InputError("give a campaign file or records; --example prints a campaign file")
    elif frequency_response:
        identify_frequency.run(given, play, period, common)
    elif identify_campaign.is_campaign(given):
        if validate or refine:
            raise InputError("--validate and --refine go with records, not with a campaign")
        identify_campaign.run(given[0], common, suggest, criterion)
    else:
        settings = {
            "form": friction,
            "gravity": gravity,
            "electrical": electrical,
            "cutoff_hz": cutoff,
            "decimation": decimation,
            "inertia_to": inertia_to,
            "refine": refine,
        }
        identify_records.run(given, validate or [], common, settings)


def _print_example() -> None:
    import textwrap

    from analyses.records import campaign_file
    from reports.cli.output import print_line

    text = (campaign_file.__doc__ or "").split("::", 1)[1]
    print_line(textwrap.dedent(text).strip())
