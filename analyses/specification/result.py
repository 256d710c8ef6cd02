"""Everything that a specification of the actuator asks for, in one result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.loops import assemble_loops
from analyses.large_signal.steady_start import linear_steady_state
from analyses.specification.capability import Capability, capability
from analyses.specification.manoeuvres import Manoeuvre, manoeuvres
from analyses.specification.plane import TorqueSpeedPlane, torque_speed_plane
from analyses.specification.steps import StepTime, step_times

if TYPE_CHECKING:
    from actuator_lti.loops import Loops

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Specification:
    """Figures for a specification sheet.

    Attributes
    ----------
    design : Design
    capabilities : tuple of Capability
        One a load torque.
    steps : tuple of StepTime
        By load torque, then from small to full deflection.
    plane : TorqueSpeedPlane
    manoeuvres : tuple of Manoeuvre
        By load torque.
    """

    design: Design
    capabilities: tuple[Capability, ...]
    steps: tuple[StepTime, ...]
    plane: TorqueSpeedPlane
    manoeuvres: tuple[Manoeuvre, ...]


def specification(
    design: Design, loops: Loops | None = None, *, progress: Progress | None = None
) -> Specification:
    """Work out and simulate the figures at each load torque of the design.

    Parameters
    ----------
    design : Design
    loops : Loops, optional
        Sampled and sliding, of this design, if they are there already.
    progress : callable, optional
        Called with (steps done, steps in all).

    Raises
    ------
    InputError, NumericalError
        As `assemble_loops` and `simulate`.
    """

    def step(done: int) -> None:
        if progress is not None:
            progress(done, 3)

    loops = assemble_loops(design) if loops is None else loops
    settling_s = linear_steady_state(loops, np.array([1.0])).settling_ticks * design.controller.period_s
    loads = design.validation.loads_Nm
    result = tuple(capability(design, load, settling_s) for load in loads)
    step(1)
    rate = min(one.figures.output_rate_rad_s for one in result)
    push = min(one.figures.acceleration_rad_s2 for one in result)
    times = step_times(design, rate, push, settling_s)
    step(2)
    moves = tuple(
        move
        for load, one in zip(loads, result, strict=True)
        for move in manoeuvres(
            design, load, one.figures.output_rate_rad_s, one.figures.acceleration_rad_s2, settling_s
        )
    )
    step(3)
    top = max(one.figures.output_rate_rad_s for one in result) * design.total_ratio
    return Specification(design, result, times, torque_speed_plane(design, top), moves)
