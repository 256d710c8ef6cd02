"""`actuator-lti designs`: the designs that come with the package."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actuator_lti.files.tree import Tree
from reports.cli.options import JsonOption

if TYPE_CHECKING:
    from actuator_lti.design import Design


def designs(as_json: JsonOption = False) -> None:
    """List the shipped designs: name, title, and the stages that each drive has."""
    from rich.padding import Padding
    from rich.text import Text

    from actuator_lti.design import load_design, shipped_designs
    from reports.cli.output import console, print_json

    rows = [_row(load_design(name)) for name in shipped_designs()]
    if as_json:
        print_json({"schema": "actuator-lti/designs", "version": 1, "designs": rows})
        return
    out = console()
    for row in rows:
        out.print(Text.assemble((row["name"], "bold"), f": {row['title']}"))
        loops = ", ".join(row["loops"]) or "no loops"
        facts = f"{row['motor']}; {loops}; total ratio {row['total_ratio']:g}"
        out.print(Padding(Text(facts), (0, 0, 0, 4)))


def _row(design: Design) -> Tree:
    """What the list says of one design."""
    from actuator_lti.design import design_hash, warnings_of

    electrical = design.motor.has_electrical_dynamics
    source = "force source" if design.axis == "linear" else "torque source"
    return {
        "name": design.name,
        "title": design.title,
        "revision": design.revision,
        "axis": design.axis,
        "motor": "resistance and inductance" if electrical else source,
        "loops": _loops(design),
        "gears": [gear.name for gear in design.gears],
        "total_ratio": design.total_ratio,
        "period_s": design.controller.period_s,
        "requirements": len(design.requirements),
        "warnings": list(warnings_of(design)),
        "hash": design_hash(design),
    }


def _loops(design: Design) -> list[str]:
    """The loops, inner one first, with their controllers and how often they run."""
    words = []
    for name in ("current", "velocity", "position"):
        loop = getattr(design.controller, name)
        if loop is not None:
            kind = "PI" if getattr(loop, "integral_time_s", None) is not None else "P"
            every = getattr(loop, "every", 1)
            words.append(f"{name} {kind}" + (f" every {every} ticks" if every > 1 else ""))
    return words
