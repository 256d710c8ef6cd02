"""What the corners return."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.design.model import Design
from analyses.corners.asked import Asked
from analyses.linear.loop_figures import LoopFigures
from analyses.specification.requirements import RequirementVerdict, tally


@dataclass(frozen=True)
class Corner:
    """The drive at one corner."""

    name: str
    words: str  # what differs from the nominal drive
    design: Design
    figures: Mapping[str, LoopFigures]  # of its sampled, sliding loops
    verdicts: tuple[RequirementVerdict, ...]

    @property
    def tally(self) -> Tally:
        """The requirements, and that every loop is stable."""
        return tally(self.verdicts) + Tally.of(Verdict.of(one.sound) for one in self.figures.values())

    @property
    def passed(self) -> bool:
        """Whether no requirement fails and every loop is stable."""
        return self.tally.passes


@dataclass(frozen=True)
class Corners:
    """All corners of a design, the nominal drive first.

    ``left_out``: requirements on what only an analysis of one design finds; they are not proven at corners.
    """

    design: Design
    asked: Asked
    corners: tuple[Corner, ...]
    left_out: tuple[RequirementVerdict, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """The worst of all corners, and of what is left out there."""
        return sum((corner.tally for corner in self.corners), tally(self.left_out)).verdict

    @property
    def passed(self) -> bool:
        """Whether every corner passes, and nothing is left out that is not waived."""
        return self.verdict.passes()
