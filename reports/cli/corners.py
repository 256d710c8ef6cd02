"""`actuator-lti corners`: margins and requirements hot, cold, on a low supply, at the worst tolerances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from actuator_lti.tree import Tree
from reports.cli.drive import SetOption, load_drive
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption

if TYPE_CHECKING:
    from analyses.corners import Corner, Corners

HotOption = Annotated[
    float | None,
    typer.Option("--hot", metavar="DEGC", help="Winding and magnets when hot; the winding's limit, or 120."),
]
ColdOption = Annotated[
    float | None, typer.Option("--cold", metavar="DEGC", help="Winding and magnets when cold; -40.")
]
SupplyOption = Annotated[
    float | None, typer.Option("--supply", metavar="V", help="The low supply; 0.8 of limits.voltage.")
]
ViscousOption = Annotated[
    float | None,
    typer.Option("--cold-viscous", metavar="FACTOR", help="Factor on viscous friction in the cold; 1."),
]


def corners(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    hot: HotOption = None,
    cold: ColdOption = None,
    supply: SupplyOption = None,
    cold_viscous: ViscousOption = None,
    as_json: JsonOption = False,
) -> None:
    """Judge the linear loops at the corners of the drive: hot, cold, low supply, worst tolerances.

    Resistance and torque constant follow \\[temperature] of the design, or copper and NdFeB. The exit status
    is 1 where a requirement is not met, or a loop not stable, at any corner. In the report: --also corners.
    """
    from analyses.corners import Asked
    from analyses.corners import corners as analyse
    from reports.cli.errors import leave_with
    from reports.cli.output import print_json, print_line
    from reports.sections.corners import summary
    from reports.terminal import print_verdict

    drive = load_drive(design, changes)
    asked = Asked.of(drive, hot_degC=hot, cold_degC=cold, supply_V=supply, cold_viscous=cold_viscous)
    result = analyse(drive, asked)
    if as_json:
        print_json(_json(result))
    else:
        print_verdict(result.passed, f"{drive.name}: {summary(result)}")
        for corner in result.corners:
            for line in _lines(corner):
                print_line(line)
    leave_with(result.passed)


def _json(result: Corners) -> Tree:
    from dataclasses import asdict

    from analyses.held_loops import HELD

    return {
        "design": result.design.name,
        "asked": asdict(result.asked),
        "passed": result.passed,
        "corners": [
            {
                "name": corner.name,
                "what": corner.words,
                "passed": corner.passed,
                "loops": {
                    name: {
                        "stable": one.margins.stable,
                        **({"judged": HELD[name]} if one.held else {}),
                        "gain_margin_db": shown.margins.gain_margin_db,
                        "phase_margin_deg": shown.margins.phase_margin_deg,
                        "bandwidth_hz": shown.bandwidth.minus3db_hz if shown.bandwidth else None,
                    }
                    for name, one, shown in ((n, f, f.judged) for n, f in corner.figures.items())
                },
                "requirements": [
                    {"id": one.id, "value": one.value, "verdict": one.verdict} for one in corner.verdicts
                ],
            }
            for corner in result.corners
        ],
    }


def _lines(corner: Corner) -> list[str]:
    from actuator_lti.quantities import CORNERED, QUANTITIES
    from reports.sections.corners import superlative, unmet, worst

    parts = []
    for quantity in (QUANTITIES[name] for name in CORNERED):
        found = worst(corner, quantity)
        if found is not None:
            value, unit = found[0] * quantity.shown[1], quantity.shown[0]
            parts.append(f"{superlative(quantity)} {quantity.words} {value:.1f} {unit} ({found[1]} loop)")
    missed = unmet(corner)
    parts.append(f"not met: {missed}" if missed else "all met")
    return [f"  {corner.name}: {corner.words}", f"    {', '.join(parts)}"]
