"""`actuator-lti failures`: what the output does when a part of the drive fails."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from actuator_lti.tree import Tree
from reports.cli.drive import SetOption, load_drive, output_quantity
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption, read_load

if TYPE_CHECKING:
    from analyses.failures import FailureCase, Failures

StopOption = Annotated[
    str | None,
    typer.Option("--stop", metavar="ANGLE", help='Mechanical stop, such as "25 deg"; the full deflection.'),
]
DeflectionOption = Annotated[
    str | None,
    typer.Option(
        "--deflection", metavar="ANGLE", help='Deflection to which times are given, such as "2 deg"; stop/10.'
    ),
]
DetectionOption = Annotated[
    float | None,
    typer.Option("--detection", metavar="S", help="Seconds from the failure to its detection; 0.1."),
]
FailureLoadOption = Annotated[
    float | None,
    typer.Option(
        "--load", metavar="LOAD", parser=read_load,
        help='Moment that pushes the output forward from the start, such as "4 N*m"; none.',
    ),
]  # fmt: skip
WatchedOption = Annotated[
    float, typer.Option("--duration", metavar="S", help="How long each failure is followed.")
]


def failures(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    stop: StopOption = None,
    deflection: DeflectionOption = None,
    detection: DetectionOption = None,
    duration: WatchedOption = 1.0,
    load: FailureLoadOption = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate jam, hard-over, open phase, frozen and lost sensor and an oscillatory command.

    Prints for each failure the time to a stated deflection and to the mechanical stop, the deflection until
    the failure is detected, the largest current and the largest moment in the train. What is not given comes
    from \\[failure] of the design. In the report: actuator-lti report DESIGN --also failures.
    """
    from analyses.failures import Asked
    from analyses.failures import failures as analyse
    from reports.cli.output import print_json, print_line

    drive = load_drive(design, changes)
    asked = Asked.of(
        drive,
        stop_rad=output_quantity("--stop", stop, drive),
        deflection_rad=output_quantity("--deflection", deflection, drive),
        detection_s=detection,
        watched_s=duration,
        load_Nm=load,
    )
    result = analyse(drive, asked)
    if as_json:
        print_json(_json(result))
        return
    for line in _lines(result):
        print_line(line)


def _json(result: Failures) -> Tree:
    """Everything but the curves, SI."""
    from dataclasses import asdict, fields

    from analyses.failures import FailureCase

    scalars = [
        each.name for each in fields(FailureCase)
        if each.name not in ("time_s", "deflection_rad", "current_A", "moment_Nm")
    ]  # fmt: skip
    return {
        "design": result.design.name,
        "axis": result.design.axis,
        "asked": asdict(result.asked),
        "cases": [{name: getattr(case, name) for name in scalars} for case in result.cases],
        "left_out": result.left_out,
    }


def _lines(result: Failures) -> list[str]:
    """The same for people."""
    from reports.sections.failures import NAMES, summary
    from reports.sections.large_signal import load_unit, output_unit

    scale, unit = output_unit(result.design)
    asked = result.asked
    lines = [
        f"{result.design.name}: {summary(result)}",
        f"  stop at {scale * asked.stop_rad:.4g} {unit}, detected after "
        f"{1e3 * asked.detection_s:.4g} ms, load {asked.load_Nm:g} {load_unit(result.design)}",
    ]
    for case in result.cases:
        lines += [f"  {NAMES[case.name]}: {case.words}", f"    {_figures(result, case)}"]
    lines += [f"  {NAMES[name]}: not for this drive, as {why}" for name, why in result.left_out.items()]
    return lines


def _figures(result: Failures, case: FailureCase) -> str:
    from reports.sections.large_signal import load_unit, output_unit

    scale, unit = output_unit(result.design)
    parts = []
    if case.to_deflection_s is not None:
        parts.append(
            f"{scale * result.asked.deflection_rad:.4g} {unit} after {1e3 * case.to_deflection_s:.4g} ms"
        )
    parts.append(
        "stop not reached" if case.to_stop_s is None else f"stop after {1e3 * case.to_stop_s:.4g} ms"
    )
    parts.append(f"{scale * case.at_detection_rad:.4g} {unit} until detected")
    if result.design.motor.has_electrical_dynamics:
        parts.append(f"up to {case.peak_current_A:.4g} A")
    parts.append(f"up to {case.peak_moment_Nm:.4g} {load_unit(result.design)}")
    if case.protected_s is not None:
        parts.append(f"overload protection after {1e3 * case.protected_s:.4g} ms")
    return ", ".join(parts)
