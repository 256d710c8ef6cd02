"""Arguments and options that several commands share; imports only typer."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reports.cli.targets import folder_for_results

if TYPE_CHECKING:
    from actuator_lti.design import Design
    from analyses.studies.engine import Engine

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


class Load(float):
    """A load as it was written: its value in SI, and the unit where one was given."""

    unit: str = ""


def on_axis(load: float, drive: Design) -> float:
    """A load of the command line, once the drive is known.

    Raises
    ------
    InputError
        For a torque on a linear axis, or a force on a rotary one.
    """
    from actuator_lti.errors import InputError

    linear, unit = drive.axis == "linear", getattr(load, "unit", "")
    if unit and unit != ("N" if linear else "N*m"):
        kind, wanted = ("force", '"40 N"') if linear else ("torque", '"4 N*m"')
        raise InputError(
            f"--load: {unit} does not fit the axis of {drive.name}; allowed: a {kind}, such as {wanted}"
        )
    return float(load)


def read_load(text: str) -> float:
    """A load with or without its unit: N m (linear axis: N) where it has none."""
    from actuator_lti.design.units import parse_quantity
    from actuator_lti.errors import InputError

    try:
        return float(text)
    except ValueError:
        pass
    for unit in ("N*m", "N"):
        try:
            load = Load(parse_quantity(text, unit))
        except InputError as error:
            message = error.message
        else:
            load.unit = unit
            return load
    reason = message.partition("; allowed")[0]
    raise typer.BadParameter(f'{reason}; allowed: a torque such as "4 N*m" (linear axis: a force, "40 N")')


def command_quantity(option: str, words: str | None, drive: Design) -> float | None:
    """An amount of the outermost loop's command in its usual unit: a plain number, or one with its unit.

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
    unit, per_SI = COMMAND_UNITS[drive.axis, drive.controller.outermost]
    try:
        value = float(words)
    except ValueError:
        pass
    else:
        if not isfinite(value):
            raise InputError(f"{option} {words}: must be a finite number")
        return value
    try:
        return parse_quantity(words, unit.replace("deg", "rad").replace("mm", "m")) * per_SI
    except InputError as error:
        reason = error.message.partition("; allowed")[0]
        raise InputError(f'{option} {words!r}: {reason}; allowed: "5 {unit}", or 5 in {unit}') from None


SchedulerOption = Annotated[
    str | None, typer.Option("--scheduler", metavar="ADDRESS", help="A Dask scheduler that is running.")
]
TlsOption = Annotated[
    Path | None,
    typer.Option("--tls", metavar="DIR", help="ca.pem, cert.pem and key.pem for a tls:// scheduler."),
]
QuietOption = Annotated[bool, typer.Option("--quiet", help="No progress on standard error.")]


def engine_of(workers: int | None, scheduler: str | None, tls: Path | None) -> Engine:
    """Where a study is computed; says what to know of the connection."""
    from analyses.studies.engine import Engine
    from reports.cli.output import print_note

    engine = Engine(workers, scheduler, tls=tls)
    if engine.caution:
        print_note(f"actuator-lti: {engine.caution}")
    return engine
