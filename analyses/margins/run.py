"""Margins, bandwidths and requirements of a design at one operating point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.design.model import Design
from actuator_lti.loops import assemble_loops
from analyses.linear.loop_figures import LoopFigures, all_loop_figures, loop_figures
from analyses.linear.loop_survey import OperatingPointFigures, operating_points
from analyses.margins.asked import Asked
from analyses.margins.measured import Measured, measured_if_asked
from analyses.specification.requirements import RequirementVerdict, evaluate_requirements, tally
from analyses.specification.weakest import Spread, spread


@dataclass(frozen=True, kw_only=True)
class Margins:
    """The loops of a design, and whether it does."""

    design: Design
    asked: Asked
    loops: Mapping[str, LoopFigures]  # by name, innermost first
    # Of the sampled loops with sliding friction, whatever is asked
    requirements: tuple[RequirementVerdict, ...]
    # The loop that is closed around the drive, broken at the drive's command
    around: Mapping[str, LoopFigures]
    operating_points: tuple[OperatingPointFigures, ...]
    measured: Measured | None = None  # a measured response over one of the loops

    @property
    def spread(self) -> Mapping[str, Mapping[str, Spread]]:
        """Least and largest margins over the operating points, by loop."""
        return spread(self.operating_points)

    @property
    def verdict(self) -> Verdict:
        """The requirements, and that every loop is stable."""
        sound = Tally.of(Verdict.of(one.sound) for one in (*self.loops.values(), *self.around.values()))
        return (tally(self.requirements) + sound).verdict

    @property
    def passed(self) -> bool:
        """Whether all is met."""
        return self.verdict.passes()


def margins(design: Design, asked: Asked | None = None) -> Margins:
    """Find the certified margins of every loop and judge the requirements.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> str(margins(load_design("emps")).verdict)
    'met'

    Raises
    ------
    InputError, NumericalError
        Where the loops cannot be assembled as asked, or the margins of one not be found.
    """
    asked = asked or Asked()
    loops = assemble_loops(
        design,
        form=asked.form,  # type: ignore[arg-type]
        operating_point=asked.operating_point,  # type: ignore[arg-type]
        load_Nm=asked.load_Nm,
    )
    step = asked.form != "continuous"  # with delays it takes its time
    around = {}
    if asked.around is not None:
        from analyses.linear.outer_loop import loop_around, read_outer_loop  # loads python-control

        outer = read_outer_loop(asked.around)
        around[outer.name] = loop_figures(loop_around(loops, outer), step=step, certify=True)
    measured = measured_if_asked(loops, asked.response, asked.response_of, asked.averages)
    figures = all_loop_figures(loops, step=step, certify=True, locked=True)
    usual = (asked.form, asked.operating_point) == ("sampled", "sliding")
    return Margins(
        design=design,
        asked=asked,
        loops=figures,
        requirements=evaluate_requirements(design, figures if usual else None),
        around=around,
        operating_points=tuple(operating_points(design, [], described=False, certify=False)),
        measured=measured,
    )
