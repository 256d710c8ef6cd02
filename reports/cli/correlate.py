"""`actuator-lti correlate`: the model against measured records."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from actuator_lti.tree import Tree
from reports.cli.drive import SetOption, load_drive
from reports.cli.options import JsonOption, QuietOption
from reports.cli.targets import folder_for_results

if TYPE_CHECKING:
    from analyses.correlation.closed_loop import CorrelationResult
    from reports.document_schema import Section

KEYS = (
    "unit",
    "samples",
    "relative_error",
    "fit_percent",
    "mean_error",
    "rms_error",
    "max_error",
    "max_error_time_s",
    "delay_s",
)
DesignPlace = Annotated[
    str, typer.Argument(metavar="DESIGN", help="Name of a shipped design, or path of a design file.")
]
RecordsArgument = Annotated[
    list[Path], typer.Argument(metavar="RECORD...", help="Records: CSV, .mat, or record files (TOML).")
]
FolderOption = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        callback=folder_for_results,
        help="Write the page with the pictures, and its JSON, there.",
    ),
]
CommandOption = Annotated[
    str | None,
    typer.Option(
        "--command",
        metavar="SIGNAL",
        help="Signal that drives the model: a recorded command (default: the outermost), or voltage (the "
        "motor's measured one).",
    ),
]
ErrorOption = Annotated[
    float | None,
    typer.Option(
        "--error-limit", metavar="PERCENT", min=0.0, help="Relative error above which a signal fails."
    ),
]
ChirpOption = Annotated[
    Path | None,
    typer.Option(
        "--predict", metavar="CHIRP", help="Fit a motor to the RECORDs (voltage steps), predict this chirp."
    ),
]


def correlate(
    design: DesignPlace,
    records: RecordsArgument,
    changes: SetOption = None,
    out: FolderOption = None,
    command: CommandOption = None,
    error_limit: ErrorOption = None,
    predict: ChirpOption = None,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Run the model with each record's own command, load and supply, and say how
    far off it is.

    For every signal that both have: relative error, fit, mean, rms and largest
    error, delay; over several records also all together, and the worst; with
    --out pictures of both and the difference. Where a record contradicts
    itself or the design's limits (a wrong unit, swapped columns, a clock that
    is off), or a signal is off by more than --error-limit, the status is 1.

    The outermost command that is recorded drives the model: reference of the
    output angle, speed, current (or torque), or voltage; loops outside it do
    not act. A recorded supply limits the voltage over time, and scales it
    where a loop sets the voltage itself.

    A CSV, Parquet or MATLAB file with columns such as time_s, reference_deg,
    Output angle \\[deg], motor_speed_rpm, current_A, load_Nm is read as it is,
    with commas, semicolons or tabs; so is what simulate writes, and the EMPS
    benchmark's file. Any other layout is told by a
    record file in TOML, a line for each: file = "log.csv", separator = ";",
    decimal = ",", time = { column = "t", unit = "ms" }, signals.reference = {
    column = "cmd", unit = "deg" }.

    Try: actuator-lti correlate emps DATA_EMPS.mat

    With --predict the records are steps of a motor on a voltage (ODrive
    recorder): gain and time constant are fitted to them and predict the speed
    over a chirp.
    """
    if predict is not None:
        _predict(records, predict, out, as_json)
        return
    from analyses.correlation import correlate_record
    from analyses.records import open_record
    from reports.cli.errors import leave_with
    from reports.cli.identify_records import named_apart
    from reports.cli.output import print_json
    from reports.cli.progress import progress
    from reports.sections import correlation as pages

    drive = load_drive(design, changes)
    results = []
    for record in named_apart([open_record(path) for path in records]):
        with progress(f"simulating {record.name}", quiet=quiet) as bar:
            results.append(correlate_record(drive, record, command=command, progress=bar))
    limit = None if error_limit is None else error_limit / 100.0
    sections = [pages.section(result, k, error_limit=limit) for k, result in enumerate(results, 1)]
    if len(results) > 1:
        sections.insert(0, pages.summary_section(results, error_limit=limit))
    verdict = pages.verdict(results, limit)
    if out is not None:
        from reports.study_pages import study_document, write_pages

        title = f"{drive.title or drive.name} against measured records"
        subtitle = ", ".join(result.record for result in results)
        document = study_document(drive, sections, title=title, subtitle=subtitle, kind="correlation")
        with progress("drawing figures", quiet=quiet) as bar:
            write_pages(document, out, "correlation", progress=bar)
    if as_json:
        print_json(_data(results) | {"passed": verdict})
    else:
        _show(sections, verdict)
    leave_with(verdict)


def _show(sections: list[Section], verdict: bool | None) -> None:
    from reports.terminal import print_section

    for k, made in enumerate(sections):
        print_section(made, verdict if k == 0 else None)


def _data(results: list[CorrelationResult]) -> Tree:
    """Every record, and all of them together."""
    from dataclasses import asdict

    from analyses.correlation import summarise, worst_of

    return {
        "records": [_plain(result) for result in results],
        "summary": {one.name: asdict(one) for one in summarise(results)},
        "worst": worst_of(results)[0].record,
    }


def _plain(result: CorrelationResult) -> Tree:
    from dataclasses import asdict

    from reports.identification_json import inputs_json

    return {
        "record": result.record,
        "sha256": result.sha256,
        "design": result.design,
        "rows": result.counts,
        "limits": result.limits,
        "notes": result.notes,
        "inputs": inputs_json(result.source, result.used),
        "findings": [asdict(finding) for finding in result.findings],
        "signals": {s.name: {key: getattr(s, key) for key in KEYS} for s in result.signals},
    }


def _predict(steps: list[Path], chirp: Path, out: Path | None, as_json: bool) -> None:
    from dataclasses import asdict

    from actuator_lti.errors import InputError
    from analyses.correlation.chirp import predict_chirp
    from analyses.correlation.voltage_motor import fit_step
    from analyses.records import open_record
    from reports.cli.output import print_json
    from reports.sections import chirp as pages

    if out is not None:
        raise InputError("--out goes with a design; --predict prints its table only")
    motor = fit_step([open_record(path) for path in steps])
    result = predict_chirp(motor, open_record(chirp))
    if as_json:
        bands = [{"from_hz": a, "to_hz": b, "relative_error": c.relative_error} for a, b, c in result.bands]
        print_json(
            {
                "motor": asdict(motor),
                "chirp": asdict(result.law),
                "relative_error": result.whole.relative_error,
                "fit_percent": result.whole.fit_percent,
                "bands": bands,
            }
        )
    else:
        _show([pages.section(motor, result, chirp.name)], None)
