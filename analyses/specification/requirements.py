"""Requirements of a design file against what was found, by loops and by analyses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING

from actuator_lti.design.model import Design
from actuator_lti.loops import assemble_loops
from analyses.linear.loop_figures import LoopFigures, all_loop_figures
from analyses.specification.verdicts import RequirementVerdict, distance, judged, tally, which_response

if TYPE_CHECKING:
    from analyses.specification.asked_figures import AskedFigures

__all__ = ["RequirementVerdict", "distance", "evaluate_requirements", "tally", "which_response"]


def evaluate_requirements(
    design: Design, figures: Mapping[str, LoopFigures] | None = None
) -> tuple[RequirementVerdict, ...]:
    """Judge every requirement of a design.

    Parameters
    ----------
    design : Design
    figures : mapping of str to LoopFigures, optional
        Of the sampled, sliding loops; computed where left out.

    Raises
    ------
    InputError
        If a requirement names a quantity or a loop that is not known.
    """
    if figures is None:
        figures = all_loop_figures(assemble_loops(design))
    asked = _AskedOnce(design)
    return tuple(
        _with_limits(design, verdict)
        for requirement in design.requirements
        for verdict in judged(design, requirement, figures, asked)
    )


def _with_limits(design: Design, verdict: RequirementVerdict) -> RequirementVerdict:
    """Beside a bandwidth to the command what rate and acceleration of the command make of it."""
    of, limits = verdict.requirement, (design.command.rate_rad_s, design.command.acceleration_rad_s2)
    if (of.quantity, verdict.loop) != ("bandwidth", "position") or of.to == "reference" or min(limits) == inf:
        return verdict
    from analyses.specification.command_limits import said_of

    return replace(verdict, reason="; ".join(filter(None, (verdict.reason, said_of(design, verdict.value)))))


class _AskedOnce:
    """Figures of analyses, run where a requirement names one; imported then."""

    def __init__(self, design: Design) -> None:
        self.design = design
        self.figures: AskedFigures | None = None

    def __call__(self, name: str) -> tuple[float | None, str]:
        from analyses.specification.asked_figures import AskedFigures, asked_figure

        if self.figures is None:
            self.figures = AskedFigures(self.design)
        return asked_figure(self.figures, name)
