"""`actuator-lti margins`: the margins of every loop on the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from actuator_lti.tree import Tree
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
    from collections.abc import Iterable, Mapping, Sequence

    from actuator_lti.loops import Loops
    from actuator_lti.verdict import Verdict
    from analyses.loop_figures import LoopFigures
    from analyses.loop_survey import OperatingPointFigures
    from analyses.requirements import RequirementVerdict

AroundOption = Annotated[
    Path | None,
    typer.Option(
        "--around",
        metavar="FILE",
        help="JSON file of a linear system that is closed around the drive, from its output to its command "
        "(an airframe with its autopilot): num and den, or A, B, C and D; dt in s, or 0 for a continuous "
        "one, then with sampling_period in s; sign -1 or 1; name, input, output.",
    ),
]


def margins(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    form: FormOption = "sampled",
    operating_point: OperatingPointOption = "sliding",
    load: LoadOption = 0.0,
    around: AroundOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print margins, bandwidths and verdicts of every loop; the margins are certified.

    Requirements are judged on the sampled loops with sliding friction, whatever form is printed.
    """
    from actuator_lti.design import warnings_of
    from actuator_lti.loops import assemble_loops
    from analyses.loop_figures import all_loop_figures
    from analyses.loop_survey import operating_points
    from analyses.requirements import evaluate_requirements
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
    outer = _outer_figures(loops, around, step=form != "continuous")
    figures = all_loop_figures(loops, step=form != "continuous", certify=True, locked=True)
    points = operating_points(drive, [], described=False, certify=False)
    judged = figures if (form, operating_point) == ("sampled", "sliding") else None
    verdicts = evaluate_requirements(drive, judged)
    where: Tree = {
        "design": drive.name,
        "form": form,
        "operating_point": operating_point,
        "load_Nm": load,
    }
    where["load_unit"] = load_unit(drive)
    if as_json:
        _print_json(where, figures, verdicts, outer, points)
    else:
        _print_tables(where, figures, verdicts, outer, points)
    leave_with(_whole(verdicts, figures, outer).passes())


def _whole(
    verdicts: Iterable[RequirementVerdict],
    figures: Mapping[str, LoopFigures],
    outer: Mapping[str, LoopFigures],
) -> Verdict:
    """The requirements, and that every loop is stable."""
    from actuator_lti.verdict import Tally, Verdict
    from analyses.requirements import tally

    sound = Tally.of(Verdict.of(one.sound) for one in (*figures.values(), *outer.values()))
    return (tally(verdicts) + sound).verdict


def _outer_figures(loops: Loops, around: Path | None, *, step: bool) -> dict[str, LoopFigures]:
    """The figures of the loop of the file, by its name; none where there is no file."""
    if around is None:
        return {}
    from analyses.loop_figures import loop_figures
    from analyses.outer_loop import loop_around
    from analyses.outer_loop_file import read_outer_loop

    outer = read_outer_loop(around)
    return {outer.name: loop_figures(loop_around(loops, outer), step=step, certify=True)}


def _print_json(
    where: Mapping[str, Any],
    figures: Mapping[str, LoopFigures],
    verdicts: Sequence[RequirementVerdict],
    outer: Mapping[str, LoopFigures],
    points: Sequence[OperatingPointFigures],
) -> None:
    """Print everything for a machine."""
    from dataclasses import asdict

    from analyses.weakest import spread
    from reports.cli.output import print_json
    from reports.loop_json import loop_json
    from reports.sections.requirements import item

    loops = {name: loop_json(result) for name, result in figures.items()}
    whole = _whole(verdicts, figures, outer)
    around = {"around": {name: loop_json(result) for name, result in outer.items()}} if outer else {}
    print_json(
        {
            **where,
            "verdict": whole,
            "passed": whole.passes(),
            "loops": loops,
            **around,
            "operating_points": {
                loop: {name: asdict(one) for name, one in found.items()}
                for loop, found in spread(points).items()
            },
            "verdicts": [item(v, where["load_unit"]) for v in verdicts],
        }
    )


def _print_tables(
    where: Mapping[str, Any],
    figures: Mapping[str, LoopFigures],
    verdicts: Sequence[RequirementVerdict],
    outer: Mapping[str, LoopFigures],
    points: Sequence[OperatingPointFigures],
) -> None:
    """Print the verdict, then the tables of the report for people."""
    from reports.sections.margins import (
        by_itself_notes,
        crossing_table,
        evidence_notes,
        margin_table,
        response_table,
        spread_table,
        with_held,
        with_own_margins,
    )
    from reports.sections.names import LOOPS
    from reports.sections.requirements import section
    from reports.terminal import print_blocks, print_verdict, side_by_side

    made = section(verdicts, where["load_unit"])
    named = {**{LOOPS[name]: result for name, result in figures.items()}, **outer}
    unstable = [name for name, result in named.items() if result.sound is False]
    unknown = [name for name, result in named.items() if result.sound is None]
    loops = f"not stable: {', '.join(unstable)}" if unstable else _stable_words(named)
    loops = f"stability not known: {', '.join(unknown)}" if unknown and not unstable else loops
    print_verdict(_whole(verdicts, figures, outer), f"{where['design']}: {loops}. {made['result']}")
    load = f"load {where['load_Nm']:g} {where['load_unit']}"
    head = f"{where['design']}: {where['form']}, {where['operating_point']}, {load}"
    said = by_itself_notes(named)
    figures_of = named
    every = with_held(named)
    named = with_own_margins(every)
    blocks: list[Any] = [
        side_by_side(head, [margin_table(named), spread_table(points, figures_of), response_table(every)])
    ]
    counts = [
        len(result.margins.gain_margins) + len(result.margins.phase_margins) for result in named.values()
    ]
    if max(counts, default=0) > 2:
        blocks.append(crossing_table(named))
    notes = [
        *said,
        *evidence_notes(named),
        *(n for f in named.values() for n in (*f.margins.notes, *f.notes)),
    ]
    notes += [f"{name}: broken at the command of the drive" for name in outer]
    print_blocks([*blocks, *made["blocks"]], notes)


def _stable_words(named: Mapping[str, LoopFigures]) -> str:
    """Say that every loop is stable, and which only with the rotor or the load's moment held."""
    from analyses.held_loops import HELD, OPEN

    held = [
        f"{label} with the {HELD[one.loop.name]} (by itself, {OPEN[one.loop.name]}, the load drives it away)"
        for label, one in named.items()
        if one.held is not None
    ]
    return f"the drive is stable, all loops closed; {', '.join(held)}" if held else "every loop is stable"
