"""`actuator-lti duty`: can the motor do this motion for ever."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Annotated

import typer

from actuator_lti.tree import Tree
from reports.cli.drive import SetOption, load_drive, output_quantity
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption, read_load

if TYPE_CHECKING:
    from analyses.duty import Duty

AmplitudeOption = Annotated[
    str | None,
    typer.Option("--amplitude", metavar="ANGLE", help='Peak, such as "5 deg"; half the full deflection.'),
]
FrequencyOption = Annotated[float | None, typer.Option("--frequency", metavar="HZ", help="Of the sine; 1.")]
ShareOption = Annotated[
    float | None,
    typer.Option("--share", help="Share of the time in motion; the drive holds still for the rest; 1."),
]
CycleOption = Annotated[
    float | None, typer.Option("--cycle", metavar="S", help="One motion and one rest together; 10.")
]
DutyLoadOption = Annotated[
    float | None,
    typer.Option(
        "--load", metavar="LOAD", parser=read_load,
        help='Moment at the output, such as "4 N*m", all the time; the largest of validation.loads.',
    ),
]  # fmt: skip


def duty(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    amplitude: AmplitudeOption = None,
    frequency: FrequencyOption = None,
    load: DutyLoadOption = None,
    share: ShareOption = None,
    cycle: CycleOption = None,
    as_json: JsonOption = False,
) -> None:
    """Hold a duty cycle against continuous current, overload protection (I2t) and winding temperature.

    The duty is a sine under a load, for a share of the time; what is not given comes from \\[duty]. The
    temperature needs thermal_resistance and thermal_time in \\[temperature], the protection limits.peak_time.
    The exit status is 1 where the drive cannot do the duty for ever. In the report: --also duty.
    """
    from analyses.duty import Asked
    from analyses.duty import duty as analyse
    from reports.cli.errors import leave_with
    from reports.cli.output import print_json, print_line
    from reports.sections.duty import summary
    from reports.terminal import print_verdict

    drive = load_drive(design, changes)
    asked = Asked.of(
        drive, amplitude_rad=output_quantity("--amplitude", amplitude, drive),
        frequency_hz=frequency, load_Nm=load, share=share, cycle_s=cycle,
    )  # fmt: skip
    result = analyse(drive, asked)
    if as_json:
        print_json(_json(result))
    else:
        print_verdict(result.passed, f"{drive.name}: {summary(result)}")
        for line in _lines(result):
            print_line(line)
    leave_with(result.passed)


def _known(value: float) -> float | None:
    return value if isfinite(value) else None


def _json(result: Duty) -> Tree:
    """Everything but the curves, SI."""
    from dataclasses import asdict

    over, heat = result.overload, result.heating
    return {
        "design": result.design.name,
        "asked": asdict(result.asked),
        "passed": result.passed,
        "rms_A": result.rms_A,
        "moving_rms_A": result.moving_rms_A,
        "holding_A": result.holding_A,
        "peak_A": result.peak_A,
        "continuous_A": _known(result.continuous_A),
        "limited": list(result.limited),
        "overload": None if over is None else asdict(over),
        "heating": None
        if heat is None
        else {
            "loss_W": heat.loss_W,
            "final_degC": _known(heat.final_degC),
            "limit_degC": _known(heat.limit_degC),
            "limit_after_s": heat.limit_after_s,
        },
    }


def _lines(result: Duty) -> list[str]:
    over, heat = result.overload, result.heating
    stated = f"{result.continuous_A:.4g} A" if isfinite(result.continuous_A) else "not stated"
    lines = [
        f"  current {result.rms_A:.4g} A rms (in motion {result.moving_rms_A:.4g} A, "
        f"peak {result.peak_A:.4g} A), continuous {stated}"
    ]
    if result.asked.share < 1.0:
        lines.append(f"  holding still: {result.holding_A:.4g} A")
    if over is not None:
        acts = "never acts" if over.acts_after_s is None else f"acts after {over.acts_after_s:.3g} s"
        lines.append(f"  overload state up to {over.peak:.3g} of 1: the protection {acts}")
    if heat is not None:
        late = "" if heat.limit_after_s is None else f", reached after {heat.limit_after_s:.4g} s"
        lines.append(
            f"  winding {heat.final_degC:.4g} °C in the long run, limit {heat.limit_degC:.4g} °C{late}"
        )
    if result.limited:
        lines.append(f"  limiters that act: {', '.join(result.limited)}; the motion is not followed as asked")
    return lines
