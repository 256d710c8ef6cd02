"""Everything that a specification of the actuator asks for, in one result."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.loops import assemble_loops
from analyses.large_signal.steady_start import linear_steady_state
from analyses.specification.capability import Capability, capability
from analyses.specification.manoeuvres import Manoeuvre, TorqueSpeedPlane, manoeuvres, torque_speed_plane
from analyses.specification.steps import StepTime, step_times

if TYPE_CHECKING:
    from actuator_lti.loops import Loops


@dataclass(frozen=True)
class Specification:
    """Figures for a specification sheet."""

    design: Design
    capabilities: tuple[Capability, ...]  # one a load torque
    steps: tuple[StepTime, ...]  # by load torque, then from small to full deflection
    plane: TorqueSpeedPlane
    manoeuvres: tuple[Manoeuvre, ...]  # by load torque


def specification(design: Design, loops: Loops | None = None) -> Specification:
    """Work out and simulate the figures at each load torque of the design.

    Parameters
    ----------
    design : Design
    loops : Loops, optional
        Sampled and sliding, of this design, if they are there already.

    Raises
    ------
    InputError, NumericalError
        As `assemble_loops` and `simulate`.
    """
    loops = assemble_loops(design) if loops is None else loops
    settling_s = linear_steady_state(loops, np.array([1.0])).settling_ticks * design.controller.period_s
    loads = design.validation.loads_Nm
    result = tuple(capability(design, load, settling_s) for load in loads)
    rate = min(one.figures.output_rate_rad_s for one in result)
    push = min(one.figures.acceleration_rad_s2 for one in result)
    times = step_times(design, rate, push, settling_s)
    moves = tuple(
        move
        for load, one in zip(loads, result, strict=True)
        for move in manoeuvres(
            design, load, one.figures.output_rate_rad_s, one.figures.acceleration_rad_s2, settling_s
        )
    )
    top = max(one.figures.output_rate_rad_s for one in result) * design.total_ratio
    return Specification(design, result, times, torque_speed_plane(design, top), moves)
