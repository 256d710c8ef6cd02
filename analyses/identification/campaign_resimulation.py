"""The design of a campaign, as written, driven at every run's speed and load."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.identification.points import SteadyPoint

RUN_UP_S = 0.3
STEADY_S = 0.2
SPEED_REACHED = 0.01
MOST_TICKS = 200_000


def steady_current_error(
    design: Design, points: Sequence[SteadyPoint], *, progress: Callable[[int, int], None] | None = None
) -> float | None:
    """Relative error of the simulated steady torques kM i over all runs; None where no run can be driven.

    Each run is a ramp of the output angle at the run's mean speed under its mean load, 0.3 s for running up
    and 0.2 s for the mean. Runs that the simulated drive does not bring to within 1 % of their speed are left
    out.
    """
    from nonlinear import commands, simulate

    constant = design.effective_motor.torque_constant_Nm_A
    duration = RUN_UP_S + STEADY_S
    period = design.controller.period_s
    if constant is None or duration / period > MOST_TICKS:
        return None
    wanted, result = [], []
    for k, point in enumerate(points, 1):
        command = commands.ramp(point.direction * point.speed_rad_s / design.total_ratio)
        try:
            run = simulate(design, command, duration, point.load_Nm)
        except (InputError, NumericalError):
            continue
        late = run.time_s >= RUN_UP_S
        speed = point.direction * float(np.mean(run.motor_speed_rad_s[late]))
        if abs(speed - point.speed_rad_s) <= SPEED_REACHED * point.speed_rad_s:
            wanted.append(point.torque_Nm)
            result.append(point.direction * constant * float(np.mean(run.current_A[late])))
        if progress is not None:
            progress(k, len(points))
    if not wanted:
        return None
    return float(np.linalg.norm(np.subtract(result, wanted)) / np.linalg.norm(wanted))
