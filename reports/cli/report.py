"""`actuator-lti report`: the whole report of a design as one page and one JSON file; `pdf` typesets one."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from actuator_lti.asked.verdict import Verdict
from actuator_lti.errors import InputError
from reports.analyses import FURTHER
from reports.cli import options
from reports.cli.errors import leave_with
from reports.cli.output import print_json, print_line, progress

SummaryOption = Annotated[
    bool, Option("--summary", help="In the PDF the first screen and one line a section: about four pages.")
]
OWN = ("report", "margins", "stiffness", "validate")  # documents of sections that a report has by itself
INCLUDE = "Add the sections that identify or correlate wrote (repeatable)."
ALSO = f"Add what takes its time: {', '.join(FURTHER)}, or all (repeatable)."
SHOWN = 8  # of what is not met or not proven


def report(
    design: options.DesignArgument = options.DEFAULT_DESIGN,
    changes: options.SetOption = None,
    out: Annotated[
        Path, Option(metavar="DIR", help="Folder for the results.", callback=options.folder_for_results)
    ] = Path("out"),
    validation: Annotated[bool, Option(help="Check every linear prediction by simulation, too.")] = True,
    pdf: Annotated[bool, Option("--pdf", help="Write report.pdf for signing as well.")] = False,
    summary: SummaryOption = False,
    include: Annotated[list[Path] | None, Option(metavar="JSON", help=INCLUDE)] = None,
    also: Annotated[list[str] | None, Option(metavar="SECTION", help=ALSO)] = None,
    response: Annotated[
        Path | None, Option(metavar="FILE", help="Lay a measured response of a loop over the model.")
    ] = None,
    response_of: Annotated[
        str, Option(metavar="LOOP", help="What --response was measured of; see margins.")
    ] = "",
    averages: Annotated[int | None, Option(help="Averages behind the coherence of --response.")] = None,
    as_json: options.JsonOption = False,
    quiet: options.QuietOption = False,
) -> None:
    """Write report.html and report.json of a design.

    The page needs no network and opens from disk. With --json the document also goes to standard output.
    With --include the results of identify and correlate become sections of it; with --also
    failure cases, duty cycle, limit cycles and corners.

    Try: actuator-lti report joint --also corners --also failures --pdf --out out/joint
    """
    from actuator_lti.design.loader import design_text
    from reports import build
    from reports.document import dumps
    from reports.terminal import print_verdict
    from reports.verdict_summary import open_items, verdict_words

    if summary and not pdf:
        raise InputError("--summary: allowed with --pdf, of which it makes a short one")
    drive = options.load_drive(design, changes)
    made = build.report(
        drive, out, validation=validation, also=FURTHER if also and "all" in also else also or (),
        added=[part for path in include or () for part in _sections(path)], response=response,
        response_of=response_of, averages=averages, source=None if changes else design_text(design),
        step=partial(progress, quiet=quiet),
    )  # fmt: skip
    written = [out / "report.html", out / "report.json"]
    if pdf:
        from reports.pdf import write_pdf

        written.append(write_pdf(made, out / "report.pdf", whole=not summary))
    if as_json:
        print_line(dumps(made).rstrip("\n"))
    else:
        first, *more = verdict_words(made["verdict"])
        print_verdict(Verdict(made["verdict"]["verdict"]), f"{drive.name}: {first}")
        open_ones = open_items(made["sections"])
        left = [f"{len(open_ones) - SHOWN} more, see the page"] * (len(open_ones) > SHOWN)
        print_line("\n".join([*more, *open_ones[:SHOWN], *left, *map(str, written)]))
    leave_with(made["verdict"]["passed"])


def _sections(path: Path) -> list[Any]:
    """The sections of a document that a report may include."""
    from reports.document import load

    made = load(path)
    if made["kind"] in OWN:
        which = "whole report" if made["kind"] == "report" else f"document of {made['kind']}"
        words = f"--include: a {which}, whose sections a report has by itself"
        raise InputError(f"{words}; allowed: what identify or correlate wrote with --out", where=str(path))
    kept = [part for part in made["sections"] if part["id"] != "provenance"]
    return [{key: own for key, own in part.items() if key != "verdict"} for part in kept]


def pdf(
    report: Annotated[Path, Argument(metavar="REPORT_JSON", help="A report.json of any command.")],
    out: Annotated[
        Path | None, Option(metavar="FILE", help="The PDF; beside the JSON where left out.")
    ] = None,
    summary: SummaryOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Typeset any report.json as PDF: cover with verdicts and lines to sign, tables, vector figures.

    Try: actuator-lti pdf out/report.json --summary --out joint.pdf
    """
    from analyses.isolation import drain
    from reports.document import load
    from reports.pdf import write_pdf

    path = write_pdf(load(report), out or report.with_suffix(".pdf"), whole=not summary)
    if as_json:
        print_json({"schema": "actuator-lti/pdf", "version": 1, "file": str(path)})
    else:
        print_line(str(path))
    damaged = drain()
    if damaged:
        raise InputError(f"{damaged[0].part}: cannot be drawn from its data; {path} says so", str(report))
