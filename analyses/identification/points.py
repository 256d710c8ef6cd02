"""From runs to points: one steady speed, motor torque and load torque a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_lti.errors import InputError
from analyses.estimation.arrays import FloatArray
from analyses.estimation.means import correlated_means
from analyses.identification.steady import SteadyCriterion, SteadyWindow, find_steady_window
from analyses.records.campaign_import import ImportedRun, SetAside


@dataclass(frozen=True, kw_only=True)
class SteadyPoint:
    """Means over the steady part of one run.

    ``speed_rad_s`` and ``torque_Nm`` (kM i) are counted positive in the direction of the motion, ``load_Nm``
    is the magnitude |M_ext|; ``direction`` is +1 or -1. ``covariance`` is that of the means of torque, speed
    and load, shape (3, 3), with their correlation in time respected.
    """

    run: str
    direction: int
    torque_Nm: float
    speed_rad_s: float
    load_Nm: float
    covariance: FloatArray
    window: SteadyWindow
    samples: int
    correlation_samples: tuple[float, float, float]
    load_is_zero: bool


def steady_point(
    run: ImportedRun, torque_constant_Nm_A: float, criterion: SteadyCriterion | None = None
) -> SteadyPoint:
    """Average the steady part of one run; M = kM i (paper, section 3).

    Raises
    ------
    InputError
        If the run has no steady part.
    """
    record = run.record
    window = find_steady_window(record.time_s, record["speed"], criterion)
    part = slice(window.start, window.stop)
    speed = record["speed"][part]
    direction = 1 if speed.mean() > 0.0 else -1
    load = np.zeros(len(speed)) if run.load_is_zero else record["torque"][part]
    side = 1.0 if load.mean() >= 0.0 else -1.0
    columns = np.column_stack(
        [direction * torque_constant_Nm_A * record["current"][part], direction * speed, side * load]
    )
    means = correlated_means(columns)
    torque, mean_speed, mean_load = (float(value) for value in means.values)
    taus = means.correlation_samples
    return SteadyPoint(
        run=run.id,
        direction=direction,
        torque_Nm=torque,
        speed_rad_s=mean_speed,
        load_Nm=mean_load,
        covariance=means.covariance,
        window=window,
        samples=means.samples,
        correlation_samples=(float(taus[0]), float(taus[1]), float(taus[2])),
        load_is_zero=run.load_is_zero,
    )


def steady_points(
    runs: tuple[ImportedRun, ...], torque_constant_Nm_A: float, criterion: SteadyCriterion | None = None
) -> tuple[tuple[SteadyPoint, ...], tuple[SetAside, ...]]:
    """The points of all runs, and the runs without a steady part, named."""
    points, aside = [], []
    for run in runs:
        try:
            points.append(steady_point(run, torque_constant_Nm_A, criterion))
        except InputError as error:
            aside.append(SetAside(id=run.id, reason=str(error)))
    return tuple(points), tuple(aside)
