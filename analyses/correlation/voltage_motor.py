"""A motor on a voltage: steady gain and time constant from a step, and what they say of another record.

Made for the ODrive records: the drive logs its voltage, and a speed that has passed its estimator, a
critically damped second-order tracker whose bandwidth is a setting (1000 rad/s unless changed).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from actuator_lti.errors import InputError, NumericalError
from analyses.estimation.arrays import FloatArray
from analyses.estimation.fit import Fit
from analyses.estimation.least_squares import by_record, correlated_covariance
from analyses.records.record import Record

ESTIMATOR_RAD_S = 1000.0
GRID_S = 1.0 / 16000.0
WINDOW_S = 1.0


@dataclass(frozen=True, kw_only=True)
class VoltageMotor:
    """``time_constant dw/dt + w = gain V``, and the speed estimator that the record has passed.

    ``gain_rad_sV`` and ``time_constant_s`` with their standard errors; ``estimator_rad_s`` is given, not
    fitted.
    """

    gain_rad_sV: float
    gain_std: float
    time_constant_s: float
    time_constant_std_s: float
    estimator_rad_s: float
    steady_speeds_rad_s: tuple[float, ...]
    relative_residual: float

    def estimated_speed(self, time_s: FloatArray, voltage_V: FloatArray) -> FloatArray:
        """Speed as the drive would log it, for a voltage on a regular grid, held between its points."""
        from scipy.signal import cont2discrete, lfilter

        period = float(time_s[1] - time_s[0])
        b = self.estimator_rad_s
        plant = [self.time_constant_s, 1.0]
        denominator = np.polymul(plant, [1.0, 2.0 * b, b * b])
        numerator, discrete, _ = cont2discrete(([self.gain_rad_sV * b * b], denominator), period)
        return np.asarray(lfilter(numerator.ravel(), discrete, voltage_V))


def fit_step(records: Sequence[Record], estimator_rad_s: float = ESTIMATOR_RAD_S) -> VoltageMotor:
    """Fit gain and time constant to the speed after a voltage step.

    The step falls somewhere between two rows; its moment is fitted too, one for each record. The standard
    errors hold the correlation in time of what is left and, with several records, the scatter between those
    fitted alone.

    Raises
    ------
    InputError
        If a record holds no step from zero.
    NumericalError
        If the fit does not converge.
    """
    steps = [_Step.of(record) for record in records]
    if not steps:
        raise InputError("at least one record of a step is needed")
    joint = _fit(steps, estimator_rad_s)
    if len(steps) == 1:
        return joint
    alone = [_fit([step], estimator_rad_s) for step in steps]
    names = ("gain", "time")
    told = [
        Fit(
            names=names,
            values=np.array([m.gain_rad_sV, m.time_constant_s]),
            covariance=np.diag([m.gain_std**2, m.time_constant_std_s**2]),
        )
        for m in alone
    ]
    scatter = by_record(told, names)
    return replace(
        joint,
        gain_std=float(np.hypot(joint.gain_std, scatter["gain"][1])),
        time_constant_std_s=float(np.hypot(joint.time_constant_std_s, scatter["time"][1])),
    )


def _fit(steps: Sequence[_Step], estimator_rad_s: float) -> VoltageMotor:
    """One motor for all steps, with the standard errors of this fit alone."""

    gain = float(np.mean([step.steady / step.level for step in steps]))

    def motor(p: FloatArray) -> VoltageMotor:
        return VoltageMotor(
            gain_rad_sV=float(p[0] * gain),
            gain_std=0.0,
            time_constant_s=float(abs(p[1]) * 1e-3),
            time_constant_std_s=0.0,
            estimator_rad_s=estimator_rad_s,
            steady_speeds_rad_s=(),
            relative_residual=0.0,
        )

    def residual(p: FloatArray) -> FloatArray:
        grid = np.arange(0.0, WINDOW_S + 0.1, GRID_S)
        unit = motor(p).estimated_speed(grid, np.ones(len(grid)))
        parts = [
            s.speed - s.level * np.interp(s.time - ms * 1e-3, grid, unit, left=0.0)
            for s, ms in zip(steps, p[2:], strict=True)
        ]
        return np.concatenate(parts)

    start = np.array([1.0, 3.0, *(s.between * 500.0 for s in steps)])
    solution = least_squares(residual, start, diff_step=1e-3, x_scale=np.maximum(np.abs(start), 0.1))
    if not solution.success:
        raise NumericalError(f"the step does not fit a first-order motor: {solution.message}")
    ends = np.cumsum([len(step.speed) for step in steps]).tolist()
    std = np.sqrt(np.diag(correlated_covariance(solution.jac, solution.fun, ends)))
    size = float(np.linalg.norm(np.concatenate([s.speed for s in steps])))
    return replace(
        motor(solution.x),
        gain_std=float(std[0] * gain),
        time_constant_std_s=float(std[1] * 1e-3),
        steady_speeds_rad_s=tuple(step.steady for step in steps),
        relative_residual=float(np.linalg.norm(solution.fun)) / size,
    )


@dataclass(frozen=True)
class _Step:
    """Speed around a step; times from the last row without voltage, ``between`` is the gap to the next."""

    time: FloatArray
    speed: FloatArray
    level: float
    steady: float
    between: float

    @staticmethod
    def of(record: Record) -> _Step:
        on = np.flatnonzero(record["voltage"] != 0.0)
        if not len(on) or on[0] == 0:
            raise InputError("no step of the voltage from zero", where=record.name)
        first = int(on[0])
        zero = float(record.time_s[first - 1])
        part = (record.time_s >= zero - 0.05) & (record.time_s <= zero + WINDOW_S)
        late = record.time_s > zero + 0.2
        return _Step(
            time=record.time_s[part] - zero,
            speed=record["speed"][part],
            level=float(np.median(record["voltage"][first:])),
            steady=float(np.mean(record["speed"][late])),
            between=float(record.time_s[first] - zero),
        )
