"""`actuator-lti pdf`: a report.json typeset for signing."""

from pathlib import Path
from typing import Annotated

import typer

from actuator_lti.errors import InputError
from reports.cli.options import JsonOption
from reports.cli.output import print_json, print_line

SummaryOption = Annotated[
    bool,
    typer.Option("--summary", help="In the PDF the first screen and one line a section: about four pages."),
]


def pdf(
    report: Annotated[Path, typer.Argument(metavar="REPORT_JSON", help="A report.json of any command.")],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The PDF; beside the JSON where left out.")
    ] = None,
    summary: SummaryOption = False,
    as_json: JsonOption = False,
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
        raise InputError(
            f"{damaged[0].part}: cannot be drawn from its data; {path} says so", where=str(report)
        )
