"""Arguments and options that several commands share; imports only typer."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reports.cli.targets import folder_for_results

if TYPE_CHECKING:
    from actuator_lti.design import Design
    from analyses.request import Kind

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


def read_quantity(option: str, words: str | None, kind: Kind, drive: Design) -> float | None:
    """A number of the command line with its unit; of a load or of the command also without it.

    Parameters
    ----------
    option : str
        For the message.
    words : str or None
    kind : {"output", "load", "command"}
        In SI: a position of the output, a load there; in its usual unit: the outermost loop's command.
    drive : Design
        Its axis and outermost loop say the unit.

    Raises
    ------
    InputError
        For no number, or a unit of something else.
    """
    from actuator_lti.design.units import parse_quantity
    from actuator_lti.errors import InputError
    from nonlinear.runs.trajectory import COMMAND_UNITS

    if words is None:
        return None
    linear, factor = drive.axis == "linear", 1.0
    if kind == "output":
        unit, allowed = ("m", 'a value such as "5 mm"') if linear else ("rad", 'a value such as "2 deg"')
    elif kind == "load":
        unit, allowed = ("N", 'a force such as "40 N"') if linear else ("N*m", 'a torque such as "4 N*m"')
    else:
        usual, factor = COMMAND_UNITS[drive.axis, drive.controller.outermost]
        unit, allowed = usual.replace("deg", "rad").replace("mm", "m"), f'"5 {usual}", or 5 in {usual}'
    try:
        bare = None if kind == "output" else float(words)
    except ValueError:
        bare = None
    if bare is not None and not isfinite(bare):
        raise InputError(f"{option} {words}: must be a finite number")
    try:
        return factor * parse_quantity(words, unit) if bare is None else bare
    except InputError as error:
        reason = error.message.partition("; allowed")[0]
        raise InputError(f"{option} {words!r}: {reason}; allowed: {allowed}") from None


QuietOption = Annotated[bool, typer.Option("--quiet", help="No progress on standard error.")]
