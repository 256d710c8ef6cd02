"""`actuator-lti montecarlo`: what the tolerances of a design do to its requirements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reports.cli.drive import SetOption, load_drive
from reports.cli.options import (
    DEFAULT_DESIGN,
    DesignArgument,
    JsonOption,
    LoadOption,
    OperatingPointOption,
    OutOption,
    QuietOption,
    SchedulerOption,
    TlsOption,
    WorkersOption,
    engine_of,
    on_axis,
)

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from analyses.monte_carlo import MonteCarloResult, MonteCarloSettings

SamplesOption = Annotated[int, typer.Option("--samples", metavar="N", help="Number of samples.")]
SeedOption = Annotated[int, typer.Option("--seed", metavar="N", help="Seed, 0 or more.")]
TableOption = Annotated[
    Path | None,
    typer.Option("--from-samples", metavar="FILE", help="CSV or Parquet of identified parameters, SI."),
]
StepOption = Annotated[
    str | None,
    typer.Option("--step", metavar="ANGLE", help='Nonlinear step of every sample, such as "1 deg".'),
]
DurationOption = Annotated[float, typer.Option("--duration", metavar="s", help="Duration of that step.")]
SampleOption = Annotated[
    int | None,
    typer.Option("--sample", metavar="K", help="Only print sample number K as a design file."),
]
AtLeastOption = Annotated[
    float | None,
    typer.Option("--at-least", metavar="P", min=0.0, max=1.0,
                 help="Probability that is enough, with 95 % confidence; else every sample must pass."),
]  # fmt: skip
WorstOption = Annotated[
    bool, typer.Option("--worst/--no-worst", help="Seek the worst case of each requirement.")
]

_SUBTITLE = "What the tolerances do to the requirements: odds, distributions, worst cases."


def montecarlo(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    samples: SamplesOption = 10_000,
    seed: SeedOption = 0,
    out: OutOption = Path("out/montecarlo"),
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    tls: TlsOption = None,
    from_samples: TableOption = None,
    step: StepOption = None,
    duration: DurationOption = 0.5,
    load: LoadOption = 0.0,
    operating_point: OperatingPointOption = "sliding",
    at_least: AtLeastOption = None,
    worst: WorstOption = True,
    sample: SampleOption = None,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Sample the tolerances: distributions, odds of every requirement, worst cases.

    Up to 1000000 samples, each is kept as Parquet under --out; of more, only what they come to. An
    interrupted run goes on where it stopped.
    """
    from analyses.monte_carlo import MonteCarloSettings, StepCheck, monte_carlo, sample_folder
    from analyses.sampling import read_table
    from reports.cli.errors import leave_with
    from reports.cli.progress import progress

    drive = load_drive(design, changes)
    load = on_axis(load, drive)
    table = None if from_samples is None else read_table(from_samples, _varying(drive))
    check = None if step is None else StepCheck(_angle(step, drive), duration, load)
    settings = MonteCarloSettings(samples, seed, operating_point, load, check, table, worst)  # type: ignore[arg-type]
    if sample is not None:
        _print_sample(drive, settings, sample)
        return
    folder = sample_folder(drive, settings, out)
    engine = engine_of(workers, scheduler, tls)
    with progress(f"sampling {drive.name}", quiet=quiet) as shown:
        result = monte_carlo(drive, folder, settings, engine=engine, progress=shown)
    leave_with(_written(drive, result, out, at_least, as_json, quiet))


def _varying(drive: Design) -> tuple[str, ...]:
    from actuator_lti.batch import variable_paths

    return variable_paths(drive)


def _angle(words: str, drive: Design) -> float:
    """Read the amplitude of a step with its unit."""
    from actuator_lti.design.units import parse_quantity
    from actuator_lti.errors import InputError

    unit = "m" if drive.axis == "linear" else "rad"
    try:
        return parse_quantity(words, unit)
    except InputError as error:
        raise InputError(f"--step {words!r}: {error.message}") from error


def _print_sample(drive: Design, settings: MonteCarloSettings, number: int) -> None:
    """Print one sample as a design file."""
    from actuator_lti.design import write_design
    from analyses.monte_carlo import replay
    from analyses.sampling import sampler_of
    from reports.cli.output import print_line

    made = replay(drive, sampler_of(drive, seed=settings.seed, table=settings.table), number)
    print_line(write_design(made).rstrip("\n"))


def _written(
    drive: Design, result: MonteCarloResult, out: Path, at_least: float | None, as_json: bool, quiet: bool
) -> bool:
    """Write page and JSON, print the verdicts; give whether they pass."""
    from reports.cli.output import print_json, print_line
    from reports.cli.progress import progress
    from reports.document import with_columns
    from reports.sections.monte_carlo import section
    from reports.study_pages import study_document, write_pages
    from reports.terminal import print_blocks, print_verdict

    part = section(result, at_least=at_least)
    title = f"{drive.title or drive.name}: tolerances"
    made = study_document(drive, [part], title=title, subtitle=_SUBTITLE, kind="montecarlo")
    with progress("drawing figures", quiet=quiet) as drawing:
        page, _ = write_pages(made, out, "montecarlo", progress=drawing)
    if as_json:
        print_json(made)
    else:
        print_verdict(made["verdict"]["passed"], part["result"])
        kept = ("label", "probability", "low", "nominal", "worst", "unit")
        tables = [with_columns(block, kept) for block in part["blocks"] if block["kind"] == "table"]
        print_blocks(tables[:1], list(result.notes))
        print_line(f"{page}\nsamples and worst designs: {result.folder}")
    return bool(made["verdict"]["passed"])
