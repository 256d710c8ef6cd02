"""Figures that only an analysis of one design can find: failures, duty, limit cycles, corners."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf

from actuator_lti.asked.quantities import ANALYSIS_QUANTITIES, QUANTITIES, Quantity
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.corners import Corners, corners
from analyses.duty import Duty, duty
from analyses.failures import Failures, failures
from analyses.limit_cycles import LimitCycles, limit_cycles
from analyses.motion.settling import ending_of


@dataclass(frozen=True)
class AskedFigures:
    """The figures of one design, each analysis run once and only where one of its figures is read.

    Attributes are the readers of `actuator_lti.asked.quantities`; ``None``: the drive has no such figure.
    """

    design: Design

    @cached_property
    def _failures(self) -> Failures:
        return failures(self.design)

    @cached_property
    def _duty(self) -> Duty:
        return duty(self.design)

    @cached_property
    def _cycles(self) -> LimitCycles:
        return limit_cycles(self.design)

    @cached_property
    def _corners(self) -> Corners:
        return corners(self.design)

    @property
    def hard_over_time_s(self) -> float:
        """From the hard-over of the power stage to the stop; inf where it is not reached while watched."""
        reached = self._failures.case("hard-over").to_stop_s
        return inf if reached is None else reached

    @property
    def failure_deflection_rad(self) -> float:
        """Largest deflection until detection over all failures."""
        return max(case.at_detection_rad for case in self._failures.cases)

    @property
    def failure_moment_Nm(self) -> float:
        """Largest moment in the train over all failures."""
        return max(case.peak_moment_Nm for case in self._failures.cases)

    @property
    def duty_current_A(self) -> float:
        """Of the duty, rms."""
        return self._duty.rms_A

    @property
    def winding_degC(self) -> float | None:
        """Of the winding under the duty, in the long run."""
        heat = self._duty.heating
        return None if heat is None else heat.final_degC

    @property
    def limit_cycle_rad(self) -> float | None:
        """Largest swing that a step of the drive as it is ends in; 0: it rests; ``None``: not known."""
        swing = self._cycles.hunting
        return 0.0 if swing is None else swing.limit_cycle_rad

    @property
    def limit_cycle_said(self) -> str:
        """After which step that is; empty where every one ends at rest."""
        swing = self._cycles.hunting
        return "" if swing is None else ending_of(self.design, swing)

    def at_corners(self, quantity: Quantity) -> float:
        """The worst of a figure over loops and corners; -inf (or inf) where one is not stable."""
        loops = [one.judged for corner in self._corners.corners for one in corner.figures.values()]
        if not all(one.stable for one in loops):
            return -quantity.better * inf
        found = (quantity.read(one) for one in loops)
        worst = min((quantity.better * value for value in found if value is not None), default=inf)
        return quantity.better * worst

    def figure(self, name: str) -> tuple[float | None, str]:
        """A figure in its unit and, where there is none, why."""
        quantity = ANALYSIS_QUANTITIES[name]
        try:
            if quantity.cornered:
                return self.at_corners(QUANTITIES[quantity.cornered]), ""
            value = quantity.read(self, self.design.axis)
        except InputError as error:
            return None, error.message
        said = "" if value is not None else "the design does not state what this needs"
        return value, self.limit_cycle_said if name == "limit_cycle" else said
