"""Arguments and options that several commands share; imports only typer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from reports.cli.targets import folder_for_results

DEFAULT_DESIGN = "ilr33-amber"
DEFAULT_OUT = Path("out")

DesignArgument = Annotated[
    str, typer.Argument(metavar="DESIGN", help="Name of a shipped design, or path of a design file.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="JSON to standard output, and nothing else there.")]
OutOption = Annotated[
    Path,
    typer.Option("--out", metavar="DIR", help="Folder for the results.", callback=folder_for_results),
]
LoadOption = Annotated[float, typer.Option("--load", metavar="N_m", help="Hinge moment at the output, N m.")]
FormOption = Annotated[
    str, typer.Option("--form", metavar="FORM", help="Linear form: sampled, continuous or ideal.")
]
OperatingPointOption = Annotated[
    str,
    typer.Option(
        "--operating-point", metavar="POINT", help="Friction: sliding, rest or describing-function."
    ),
]
WorkersOption = Annotated[
    int | None, typer.Option("--workers", metavar="N", help="Processes of a local Dask cluster.")
]
SchedulerOption = Annotated[
    str | None, typer.Option("--scheduler", metavar="ADDRESS", help="A Dask scheduler that is running.")
]
TlsOption = Annotated[
    Path | None,
    typer.Option("--tls", metavar="DIR", help="ca.pem, cert.pem and key.pem for a tls:// scheduler."),
]
QuietOption = Annotated[bool, typer.Option("--quiet", help="No progress on standard error.")]
