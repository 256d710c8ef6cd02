"""`actuator-lti export linear`: loops, break points and responses as state space."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from reports.cli.drive import SetOption, load_drive
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption
from reports.cli.targets import refuse_existing


class To(StrEnum):
    """Formats."""

    json = "json"
    mat = "mat"
    python = "python"


def linear(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    to: Annotated[To, typer.Option("--to", help="Format.")] = To.json,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="File to write; default NAME-linear.json, .mat or .py."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite a file that exists.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Write every loop, break point, command and load response as state space, with units and margins."""
    from actuator_lti.files.atomic import write_bytes
    from reports.cli.output import print_json, print_line
    from reports.linear_models import FORMS, SUFFIXES, linear_models, written_models

    drive = load_drive(design, changes)
    target = out or Path(f"{drive.name}-linear{SUFFIXES[to]}")
    refuse_existing(target, force)
    tree = linear_models(drive)
    data = written_models(tree, to)
    write_bytes(target, data)
    named = [*tree["sampled"]["loops"], *tree["sampled"]["break_points"], *tree["sampled"]["responses"]]
    if as_json:
        about = {"file": str(target), "to": str(to), "bytes": len(data)}
        print_json({"schema": "actuator-lti/export-linear", "version": 1, **about, "systems": named})
    else:
        print_line(f"{target}: {', '.join(named)}, {' and '.join(FORMS)}, {len(data)} bytes")
