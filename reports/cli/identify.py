"""`actuator-lti identify`: friction from a campaign, inertia and friction from one motion, a virtual "
"bench."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from reports.cli.options import JsonOption, QuietOption
from reports.cli.targets import folder_for_results, refuse_existing

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from analyses.identification.campaign import CampaignResult

CampaignArgument = Annotated[
    Path | None, typer.Argument(metavar="CAMPAIGN", help="Campaign file (TOML); --example prints one.")
]
DynamicOption = Annotated[
    Path | None,
    typer.Option("--dynamic", metavar="RECORD", help="Inertia and friction from one record instead."),
]
BenchOption = Annotated[
    Path | None,
    typer.Option(
        "--virtual-bench", metavar="DIR", help="Write the files of a simulated campaign there instead."
    ),
]
SeedOption = Annotated[int, typer.Option("--seed", min=0, help="Seed of the virtual bench.")]
DesignOption = Annotated[
    str | None,
    typer.Option(
        "--design", metavar="DESIGN", help="Design by name or path (default: the campaign's, or emps)."
    ),
]
FrictionOption = Annotated[
    str, typer.Option("--friction", metavar="FORM", help="With --dynamic: symmetric or per-direction.")
]
RefineOption = Annotated[
    bool, typer.Option("--refine", help="With --dynamic: refine by simulating the closed loop.")
]
CutoffOption = Annotated[
    float, typer.Option("--cutoff", metavar="Hz", help="With --dynamic: low-pass cut-off.")
]
DecimationOption = Annotated[int, typer.Option("--decimation", min=1, help="With --dynamic: decimation.")]
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
        help="Write page, JSON and the identified design file there.",
    ),
]
ForceOption = Annotated[
    bool, typer.Option("--force", help="With --virtual-bench: overwrite a campaign that is there.")
]
ExampleOption = Annotated[
    bool, typer.Option("--example", help="Print a campaign file to start from, and stop.")
]


def identify(
    campaign: CampaignArgument = None,
    dynamic: DynamicOption = None,
    virtual_bench: BenchOption = None,
    design: DesignOption = None,
    seed: SeedOption = 0,
    force: ForceOption = False,
    friction: FrictionOption = "symmetric",
    refine: RefineOption = False,
    cutoff: CutoffOption = 100.0,
    decimation: DecimationOption = 10,
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

    identify --dynamic record.toml --design my.toml: inertia, friction and
    offset from one motion, by the inverse dynamic model; --refine simulates
    the closed loop as well. The EMPS benchmark's file is known as it is.

    identify --virtual-bench folder --seed 1: simulate a campaign of 54 runs,
    and write logs and campaign.toml as a bench would. Try the first way on
    it.
    """
    from actuator_lti.errors import InputError

    chosen = [x for x in (campaign, dynamic, virtual_bench) if x is not None]
    if example:
        _print_example()
    elif len(chosen) != 1:
        raise InputError("give one of: a campaign file, --dynamic RECORD, --virtual-bench DIR")
    elif campaign is not None:
        _campaign(campaign, design, suggest, criterion, out, as_json, quiet)
    elif dynamic is not None:
        _dynamic(dynamic, design or "emps", friction, refine, cutoff, decimation, out, as_json, quiet)
    elif virtual_bench is not None:
        _bench(virtual_bench, design or "ilr33-amber", seed, force, as_json, quiet)


def _print_example() -> None:
    import textwrap

    from analyses.records import campaign_file
    from reports.cli.output import print_line

    text = (campaign_file.__doc__ or "").split("::", 1)[1]
    print_line(textwrap.dedent(text).strip())


def _campaign(
    path: Path, name: str | None, count: int, criterion: str, out: Path | None, as_json: bool, quiet: bool
) -> None:
    from actuator_lti.design import load_design
    from analyses.campaign_design import suggest_runs
    from analyses.identification.campaign import identify_campaign
    from analyses.identification.contributions import contributions
    from analyses.records import import_campaign, load_campaign
    from reports.cli.output import print_json
    from reports.cli.progress import progress
    from reports.identification_json import campaign_json
    from reports.sections import identification as pages

    listed = load_campaign(path)
    drive = load_design(_beside(listed.design, path) if name is None else name)
    with progress("reading records", quiet=quiet) as bar:
        imported = import_campaign(listed, progress=bar)
    with progress("identifying", quiet=quiet) as bar:
        result = identify_campaign(imported, drive, progress=bar)
    at = _where(drive, result)
    shares = contributions(result.fit.values, result.fit.covariance, **at)
    suggestion = None
    if count:
        with progress("slopes of the margins", quiet=quiet) as bar:
            suggestion = suggest_runs(
                drive, result.fit, listed.instruments, count=count, criterion=criterion, progress=bar
            )
    made = pages.section(result, shares, suggestion, **at)
    if out is not None:
        from analyses.identification.to_design import design_with_estimate, surface_estimate

        source = f"identified from {len(result.fit.points)} runs, {listed.name}"
        identified = design_with_estimate(drive, surface_estimate(result.fit, source))
        _write(drive, identified, made, source, out, quiet)
    if as_json:
        print_json(campaign_json(result, shares, suggestion, at))
        return
    _print_campaign(made, out)


def _beside(design: str, campaign: Path) -> str:
    """A design named by a path is looked for beside the campaign file."""
    near = campaign.parent / design
    return str(near) if near.suffix == ".toml" and near.exists() else design


def _where(drive: Design, result: CampaignResult) -> dict[str, float]:
    """Load and speed for the contributions: the design's largest ones, else those of the runs."""
    import math

    load, speed = drive.load.moment_max_Nm, drive.limits.speed_rad_s
    points = result.fit.points
    return {
        "load_Nm": load if load > 0.0 else max(p.load_Nm for p in points),
        "speed_rad_s": speed if math.isfinite(speed) else max(p.speed_rad_s for p in points),
    }


def _print_campaign(made: dict[str, Any], out: Path | None) -> None:
    from reports.cli.output import print_line
    from reports.terminal import print_blocks

    print_line(made["intro"])
    print_blocks([block for block in made["blocks"] if block["kind"] in ("table", "text")])
    if out is not None:
        print_line(f"written: {out}")


def _dynamic(
    path: Path,
    name: str,
    friction: str,
    refine: bool,
    cutoff: float,
    decimation: int,
    out: Path | None,
    as_json: bool,
    quiet: bool,
) -> None:
    from actuator_lti.design import load_design
    from analyses.identification.dynamic import Recipe
    from analyses.identification.from_record import identify_record, refine_record
    from analyses.identification.to_design import design_with_estimate, dynamic_estimate
    from analyses.records import open_record
    from reports.cli.output import print_json, print_line
    from reports.cli.progress import progress
    from reports.sections import dynamic_identification as pages
    from reports.terminal import print_blocks

    drive, record = load_design(name), open_record(path)
    recipe = Recipe(cutoff_hz=cutoff, decimation=decimation)
    model, notes = identify_record(drive, record, form=friction, recipe=recipe)  # type: ignore[arg-type]
    refined = None
    if refine:
        with progress("simulating the closed loop", quiet=quiet) as bar:
            refined = refine_record(drive, record, model, progress=bar)
    made = pages.section(model, drive.axis, (f"{record.name}: {record.counts}", *notes), refined)
    if out is not None:
        source = f"identified from {record.name}"
        identified = design_with_estimate(drive, dynamic_estimate(model, source))
        _write(drive, identified, made, source, out, quiet)
    if as_json:
        values = zip(model.names, model.values, model.standard_errors, strict=True)
        print_json(
            {
                "record": record.name,
                "rows_in": record.counts.rows_in,
                "rows_out": record.counts.rows_out,
                "parameters": {n: {"value": v, "standard_error": s} for n, v, s in values},
                "covariance": model.covariance,
                "relative_residual": model.relative_residual,
                "refined": None if refined is None else dict(refined.values),
                "refined_standard_errors": None if refined is None else dict(refined.standard_errors),
            }
        )
        return
    print_line(made["intro"])
    print_blocks([block for block in made["blocks"] if block["kind"] in ("table", "text")])


def _bench(folder: Path, name: str, seed: int, force: bool, as_json: bool, quiet: bool) -> None:
    from actuator_lti.design import load_design
    from analyses.virtual_bench import simulate_bench
    from analyses.virtual_bench_files import write_bench
    from analyses.virtual_bench_instruments import measure_bench
    from reports.cli.output import print_json, print_line
    from reports.cli.progress import progress

    refuse_existing(folder / "campaign.toml", force)
    drive = load_design(name)
    with progress("simulating the runs", quiet=quiet) as bar:
        runs = simulate_bench(drive, seed=seed, progress=bar)
    logs, errors = measure_bench(runs, seed)
    written = Path(name).resolve() if name.endswith(".toml") else name
    with progress("writing the logs", quiet=quiet) as bar:
        path = write_bench(folder, logs, design=str(written), seed=seed, progress=bar)
    if as_json:
        from dataclasses import asdict

        print_json({"campaign": str(path), "runs": len(logs), "seed": seed, "true_errors": asdict(errors)})
    else:
        print_line(f"{len(logs)} runs written; next: actuator-lti identify {path}")


def _write(
    drive: Design, identified: Design, made: dict[str, Any], source: str, out: Path, quiet: bool
) -> None:
    from actuator_lti.atomic import write_text
    from actuator_lti.design import write_design
    from reports.cli.progress import progress
    from reports.study_pages import study_document, write_pages

    document = study_document(
        identified,
        [made],
        title=f"Identification of {drive.title or drive.name}",
        subtitle=source,
        kind="identification",
    )
    with progress("drawing figures", quiet=quiet) as bar:
        write_pages(document, out, "identification", progress=bar)
    write_text(out / f"{drive.name}-identified.toml", write_design(identified))
