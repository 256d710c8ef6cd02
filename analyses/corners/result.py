"""What the corners return."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from actuator_lti.design.model import Design
from analyses.corners.asked import Asked
from analyses.linear.loop_figures import LoopFigures
from analyses.specification.verdicts import RequirementVerdict, tally


@dataclass(frozen=True)
class Corner:
    """The drive at one corner.

    Attributes
    ----------
    name : str
    words : str
        What differs from the nominal drive.
    design : Design
    figures : mapping of str to LoopFigures
        Of its sampled, sliding loops.
    verdicts : tuple of RequirementVerdict
    """

    name: str
    words: str
    design: Design
    figures: Mapping[str, LoopFigures]
    verdicts: tuple[RequirementVerdict, ...]

    @property
    def passed(self) -> bool:
        """Whether no requirement fails and every loop is stable."""
        return tally(self.verdicts).passes and all(one.sound for one in self.figures.values())


@dataclass(frozen=True)
class Corners:
    """All corners of a design, the nominal drive first."""

    design: Design
    asked: Asked
    corners: tuple[Corner, ...]

    @property
    def passed(self) -> bool:
        """Whether every corner passes."""
        return all(corner.passed for corner in self.corners)
