"""The published records of a motor on a voltage (ODrive recorder): fitted to steps, held against a chirp.

    python -m examples.odrive_motor step1.csv step2.csv chirp1.csv

The last record is the chirp. The rows are too far apart (5.5 ms) for ``actuator-lti identify``: the moment
of the step falls between two of them and is fitted with gain and time constant, and the chirp's later part is
known only from its law, which the well-sampled beginning tells. The drive logs a speed that has passed its
estimator, a critically damped second-order tracker whose bandwidth is a setting (1000 rad/s unless changed).
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import least_squares

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.types import Floats
from analyses import open_record
from analyses.correlation.compare import SignalComparison, compare_signals
from analyses.estimation.fit import Fit
from analyses.estimation.least_squares import by_record, correlated_covariance
from analyses.records.record import Record

ESTIMATOR_RAD_S = 1000.0
GRID_S = 1.0 / 16000.0
WINDOW_S = 1.0
TOLERANCE = 0.01  # of the amplitude: the law holds
EDGES_HZ = (4, 8, 16, 32)  # of the bands


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

    def estimated_speed(self, time_s: Floats, voltage_V: Floats) -> Floats:
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

    Raises `InputError`: if a record holds no step from zero. Raises `NumericalError`: if the fit does not
    converge.
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

    def motor(p: Floats) -> VoltageMotor:
        return VoltageMotor(
            gain_rad_sV=float(p[0] * gain),
            gain_std=0.0,
            time_constant_s=float(abs(p[1]) * 1e-3),
            time_constant_std_s=0.0,
            estimator_rad_s=estimator_rad_s,
            steady_speeds_rad_s=(),
            relative_residual=0.0,
        )

    def residual(p: Floats) -> Floats:
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

    time: Floats
    speed: Floats
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


@dataclass(frozen=True, kw_only=True)
class ChirpLaw:
    """``amplitude sin(2 pi f0 (exp(rate (t - start)) - 1) / rate)`` from ``start_s`` on.

    ``relative_residual`` is that of the samples up to ``end_s``, where it has been found to hold.
    """

    amplitude: float
    start_hz: float
    rate_per_s: float
    start_s: float
    end_s: float
    relative_residual: float

    def __call__(self, time_s: Floats) -> Floats:
        since = np.maximum(time_s - self.start_s, 0.0)
        phase = 2.0 * np.pi * self.start_hz * np.expm1(self.rate_per_s * since) / self.rate_per_s
        return np.asarray(self.amplitude * np.sin(phase))

    def frequency_hz(self, time_s: float) -> float:
        """Frequency at a time."""
        return float(self.start_hz * np.exp(self.rate_per_s * max(time_s - self.start_s, 0.0)))


@dataclass(frozen=True, kw_only=True)
class ChirpPrediction:
    """The prediction of a chirp, over the whole law and in bands: (from Hz, to Hz, comparison)."""

    law: ChirpLaw
    whole: SignalComparison
    bands: tuple[tuple[float, float, SignalComparison], ...]


def find_chirp(time_s: Floats, signal: Floats) -> ChirpLaw:
    """Fit the law to the well-sampled beginning and follow it on as long as the samples agree.

    Raises `InputError`: if the beginning is no exponential chirp, to 1 % of its amplitude.
    """

    on = np.flatnonzero(signal != 0.0)
    if len(on) < 50 or on[0] == 0:
        raise InputError("no chirp that starts from rest")
    begin, amplitude = float(time_s[on[0] - 1]), float(np.max(np.abs(signal)))
    crossing = _crossings(time_s[on[0] :], signal[on[0] :])
    if len(crossing) < 4:
        raise InputError("no chirp: fewer than four zero crossings")
    halves = 0.5 / np.diff(crossing[:4])
    rate = float(np.log(halves[1] / halves[0]) / (0.5 * (crossing[2] - crossing[0])))
    p = np.array([halves[0] * np.exp(-rate * (0.5 * (crossing[0] + crossing[1]) - begin)), rate, 0.0, 1.0])

    def law(p: Floats, end: float, residual: float = 0.0) -> ChirpLaw:
        return ChirpLaw(
            amplitude=float(p[3] * amplitude), start_hz=float(p[0]), rate_per_s=float(p[1]),
            start_s=begin + float(p[2]), end_s=end, relative_residual=residual,
        )  # fmt: skip

    result: ChirpLaw | None = None
    end = float(crossing[3])
    while end <= time_s[-1]:
        part = (time_s >= begin) & (time_s <= end)
        t, y = time_s[part], signal[part]
        fit = least_squares(lambda p, t=t, y=y, e=end: law(p, e)(t) - y, p, x_scale=[0.01, 0.01, 1e-3, 0.01])
        size = float(np.linalg.norm(fit.fun) / np.linalg.norm(y))
        newest = t > end - 0.1
        if size > TOLERANCE or np.max(np.abs(fit.fun[newest]), initial=0.0) > 5.0 * TOLERANCE * amplitude:
            break
        p, result = fit.x, law(fit.x, end, size)
        end += 0.05
    if result is None:
        raise InputError("no chirp: the beginning does not follow an exponential law to 1 %")
    return result


def predict_chirp(motor: VoltageMotor, record: Record) -> ChirpPrediction:
    """Predict the logged speed of a chirp record, as far as its voltage is known, and compare it in bands.

    The voltage between the rows comes from the law of the chirp, since the rows are too far apart for its
    later part.
    """
    law = find_chirp(record.time_s, record["voltage"])
    grid = np.arange(0.0, law.end_s + GRID_S, GRID_S)
    speed = motor.estimated_speed(grid, law(grid))
    part = (record.time_s > law.start_s) & (record.time_s <= law.end_s)
    time, measured = record.time_s[part], record["speed"][part]
    modelled = np.interp(time, grid, speed)
    frequency = np.array([law.frequency_hz(float(t)) for t in time])
    limits = [law.start_hz, *(e for e in EDGES_HZ if e < frequency[-1]), float(frequency[-1])]
    bands = []
    for low, high in pairwise(limits):
        here = (frequency >= low) & (frequency <= high)
        if np.count_nonzero(here) >= 10:
            name = f"speed, {low:.3g} to {high:.3g} Hz"
            bands.append(
                (low, high, compare_signals(name, "rad/s", time[here], measured[here], modelled[here]))
            )
    whole = compare_signals("speed", "rad/s", time, measured, modelled)
    return ChirpPrediction(law=law, whole=whole, bands=tuple(bands))


def _crossings(time_s: Floats, signal: Floats) -> Floats:
    k = np.flatnonzero(signal[:-1] * signal[1:] < 0.0)
    return np.asarray(time_s[k] - signal[k] * (time_s[k + 1] - time_s[k]) / (signal[k + 1] - signal[k]))


def main(files: Sequence[str]) -> None:
    """Fit a motor to the steps, predict the chirp, which comes last, and print how well."""
    *steps, chirp = (open_record(file) for file in files)
    motor = fit_step(steps)
    found = predict_chirp(motor, chirp)
    sys.stdout.write(
        f"gain {motor.gain_rad_sV:.2f} rad/(s V) (standard error {motor.gain_std:.2f}), time constant "
        f"{1e3 * motor.time_constant_s:.2f} ms ({1e3 * motor.time_constant_std_s:.2f} ms)\n"
    )
    for one in (*(band for _, _, band in found.bands), found.whole):
        told = f"error {100.0 * one.relative_error:.2f} %, fit {one.fit_percent:.2f} %"
        sys.stdout.write(f"{one.name}: {told}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
