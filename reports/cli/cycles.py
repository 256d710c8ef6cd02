"""`actuator-lti cycles`: limit cycles of play and of a quantised sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actuator_lti.tree import Tree
from reports.cli.drive import SetOption, load_drive
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption

if TYPE_CHECKING:
    from analyses.limit_cycles import LimitCycles


def cycles(
    design: DesignArgument = DEFAULT_DESIGN, changes: SetOption = None, as_json: JsonOption = False
) -> None:
    """Foresee limit cycles of play and of a quantised output sensor, and seek them in the simulator.

    Each is foreseen by describing function in the exact sampled loop, then the simulator is started in its
    shape at sizes from 0.4 to 2.5 of it. Last, steps of the drive as it is are waited for. The exit status
    is 1 where such a step ends in a cycle. In the report: --also cycles.
    """
    from analyses.limit_cycles import limit_cycles
    from reports.cli.errors import leave_with
    from reports.cli.output import print_json, print_line
    from reports.sections.cycles import summary
    from reports.terminal import print_verdict

    result = limit_cycles(load_drive(design, changes))
    if as_json:
        print_json(_json(result))
    else:
        print_verdict(result.hunting is None, f"{result.design.name}: {summary(result)}")
        for line in _lines(result):
            print_line(line)
    leave_with(result.hunting is None)


def _json(limit_cycles: LimitCycles) -> Tree:
    """SI, at the output."""
    return {
        "design": limit_cycles.design.name,
        "looked_for": list(limit_cycles.looked_for),
        "foreseen": [
            {
                "cause": one.cycle.cause,
                "with_friction": one.cycle.with_friction,
                "attracting": one.cycle.stable,
                "amplitude": one.cycle.output_rad,
                "frequency_hz": one.cycle.frequency_hz,
                "simulated_amplitude": None if one.ratio is None else one.ratio * one.cycle.output_rad,
                "simulated_hz": one.frequency_hz,
            }
            for one in limit_cycles.confirmations
        ],
        "steps": [
            {
                "load": one.load_Nm,
                "step": one.amplitude_rad,
                "hunting": one.hunting,
                **vars(one.rest),
            }
            for one in limit_cycles.rests
        ],
    }


def _lines(limit_cycles: LimitCycles) -> list[str]:
    from reports.sections.cycles import CAUSES
    from reports.sections.large_signal import output_unit

    scale, unit = output_unit(limit_cycles.design)
    lines = []
    for one in limit_cycles.confirmations:
        cycle = one.cycle
        kind = "attracting" if cycle.stable else "border"
        friction = "with" if cycle.with_friction else "without"
        seen = "refuted by simulation"
        if one.ratio is not None:
            seen = f"simulated ±{scale * one.ratio * cycle.output_rad:.3g} {unit}"
            seen += "" if one.frequency_hz is None else f" at {one.frequency_hz:.3g} Hz"
        size = f"±{scale * cycle.output_rad:.3g} {unit} at {cycle.frequency_hz:.3g} Hz"
        lines.append(f"  {CAUSES[cycle.cause]}, {friction} dry friction: {kind} cycle of {size}, {seen}")
    return lines
