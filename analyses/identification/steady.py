"""The means of the steady part of each run: one point a run."""

from dataclasses import dataclass

import numpy as np

from actuator_lti.types import Floats
from analyses.estimation.series import correlated_means
from analyses.records.campaign_import import ImportedRun
from analyses.records.steady_window import SteadyWindow, find_steady_window


@dataclass(frozen=True, kw_only=True)
class SteadyPoint:
    """Means over the steady part of one run, torque and speed positive in the direction of the motion."""

    run: str
    direction: int  # +1 or -1
    torque_Nm: float  # kM i
    speed_rad_s: float
    load_Nm: float  # magnitude |M_ext|
    covariance: Floats  # of the means of torque, speed and load, (3, 3), by their correlation in time
    window: SteadyWindow
    samples: int
    correlation_samples: tuple[float, ...]
    load_is_zero: bool


def steady_point(run: ImportedRun, torque_constant_Nm_A: float) -> SteadyPoint:
    """Average the steady part of one run; M = kM i (paper, section 3)."""
    window = find_steady_window(run.record.time_s, run.record["speed"])
    part = run.record.slice(window.start, window.stop)
    speed = part["speed"]
    load = np.zeros(len(speed)) if run.load_is_zero else part["torque"]
    direction, side = 1 if speed.mean() > 0.0 else -1, 1.0 if load.mean() >= 0.0 else -1.0
    torque = direction * torque_constant_Nm_A * part["current"]
    means = correlated_means(np.column_stack([torque, direction * speed, side * load]))
    mean_torque, mean_speed, mean_load = means.values.tolist()
    return SteadyPoint(
        run=run.id,
        direction=direction,
        torque_Nm=mean_torque,
        speed_rad_s=mean_speed,
        load_Nm=mean_load,
        covariance=means.covariance,
        window=window,
        samples=len(speed),
        correlation_samples=tuple(means.correlation_samples.tolist()),
        load_is_zero=run.load_is_zero,
    )
