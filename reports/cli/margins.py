"""`actuator-lti margins`: the margins of every loop on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from reports.cli.drive import SetOption, load_drive
from reports.cli.options import (
    DEFAULT_DESIGN,
    DesignArgument,
    FormOption,
    JsonOption,
    LoadOption,
    OperatingPointOption,
    on_axis,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from analyses.loop_figures import LoopFigures
    from analyses.requirements import RequirementVerdict


def margins(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    form: FormOption = "sampled",
    operating_point: OperatingPointOption = "sliding",
    load: LoadOption = 0.0,
    as_json: JsonOption = False,
) -> None:
    """Print margins, bandwidths and verdicts of every loop.

    Requirements are judged on the sampled loops with sliding friction, whatever form is printed.
    """
    from actuator_lti.design import warnings_of
    from actuator_lti.loops import assemble_loops
    from analyses.loop_figures import all_loop_figures
    from analyses.requirements import all_pass, evaluate_requirements
    from reports.cli.errors import leave_with
    from reports.cli.output import print_warning
    from reports.sections.names import load_unit

    drive = load_drive(design, changes)
    load = on_axis(load, drive)
    for warning in warnings_of(drive):
        print_warning(f"{drive.name}: {warning}")
    loops = assemble_loops(
        drive,
        form=form,  # type: ignore[arg-type]
        operating_point=operating_point,  # type: ignore[arg-type]
        load_Nm=load,
    )
    figures = all_loop_figures(loops, step=form != "continuous")
    judged = figures if (form, operating_point) == ("sampled", "sliding") else None
    verdicts = evaluate_requirements(drive, judged)
    where: dict[str, Any] = {
        "design": drive.name,
        "form": form,
        "operating_point": operating_point,
        "load_Nm": load,
    }
    where["load_unit"] = load_unit(drive)
    if as_json:
        _print_json(where, figures, verdicts)
    else:
        _print_tables(where, figures, verdicts)
    leave_with(all_pass(verdicts) and all(found.margins.stable is not False for found in figures.values()))


def _print_json(
    where: Mapping[str, Any], figures: Mapping[str, LoopFigures], verdicts: Sequence[RequirementVerdict]
) -> None:
    """Print everything for a machine."""
    from analyses.requirements import all_pass
    from reports.cli.output import print_json
    from reports.loop_json import loop_json
    from reports.sections.requirements import item

    loops = {name: loop_json(found) for name, found in figures.items()}
    passed = all_pass(tuple(verdicts)) and all(
        found.margins.stable is not False for found in figures.values()
    )
    print_json(
        {
            **where,
            "passed": passed,
            "loops": loops,
            "verdicts": [item(v, where["load_unit"]) for v in verdicts],
        }
    )


def _print_tables(
    where: Mapping[str, Any], figures: Mapping[str, LoopFigures], verdicts: Sequence[RequirementVerdict]
) -> None:
    """Print the verdict, then the tables of the report for people."""
    from analyses.requirements import all_pass
    from reports.sections.margins import crossing_table, margin_table, response_table
    from reports.sections.names import LOOPS
    from reports.sections.requirements import section
    from reports.terminal import print_blocks, print_verdict, side_by_side

    made = section(verdicts, where["load_unit"])
    unstable = [LOOPS[name] for name, found in figures.items() if found.margins.stable is False]
    unknown = [LOOPS[name] for name, found in figures.items() if found.margins.stable is None]
    loops = f"not stable: {', '.join(unstable)}" if unstable else "every loop is stable"
    loops = f"stability not known: {', '.join(unknown)}" if unknown and not unstable else loops
    print_verdict(all_pass(tuple(verdicts)) and not unstable, f"{where['design']}: {loops}. {made['result']}")
    named = {LOOPS[name]: found for name, found in figures.items()}
    load = f"load {where['load_Nm']:g} {where['load_unit']}"
    head = f"{where['design']}: {where['form']}, {where['operating_point']}, {load}"
    blocks: list[Any] = [side_by_side(head, [margin_table(named), response_table(named)])]
    if any(
        len(found.margins.gain_margins) + len(found.margins.phase_margins) > 2 for found in figures.values()
    ):
        blocks.append(crossing_table(named))
    notes = [note for found in figures.values() for note in (*found.margins.notes, *found.notes)]
    print_blocks([*blocks, *made["blocks"]], notes)
