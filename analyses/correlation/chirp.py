"""An exponential chirp found again from its samples, and what a motor model predicts over it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import least_squares

from actuator_lti.errors import InputError
from analyses.correlation.compare import SignalComparison, compare_signals
from analyses.correlation.voltage_motor import GRID_S, VoltageMotor
from analyses.estimation.arrays import FloatArray
from analyses.records.record import Record

TOLERANCE = 0.01  # of the amplitude: the law holds
EDGES_HZ = (4, 8, 16, 32)  # of the bands


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

    def __call__(self, time_s: FloatArray) -> FloatArray:
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


def find_chirp(time_s: FloatArray, signal: FloatArray) -> ChirpLaw:
    """Fit the law to the well-sampled beginning and follow it on as long as the samples agree.

    Raises
    ------
    InputError
        If the beginning is no exponential chirp, to 1 % of its amplitude.
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

    def law(p: FloatArray, end: float, residual: float = 0.0) -> ChirpLaw:
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


def _crossings(time_s: FloatArray, signal: FloatArray) -> FloatArray:
    k = np.flatnonzero(signal[:-1] * signal[1:] < 0.0)
    return np.asarray(time_s[k] - signal[k] * (time_s[k + 1] - time_s[k]) / (signal[k + 1] - signal[k]))
