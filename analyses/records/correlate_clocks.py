"""Offset and rate of a second clock, from the likeness of two signals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_lti.errors import InputError
from analyses.estimation.arrays import FloatArray
from analyses.estimation.means import best_lag, correlation_time

GRID = 4000
MIN_QUALITY = 0.5
RATE_STD_MAX = 1e-3


@dataclass(frozen=True)
class Fit:
    """``t_first = offset_s + rate * t_second``, with standard deviations and the correlation reached.

    ``rate`` is 1 and ``rate_std`` None where the records do not tell it (a single event).
    ``offset_std_s`` is that of the offset at the middle of the second record.
    """

    offset_s: float
    offset_std_s: float
    rate: float
    rate_std: float | None
    quality: float


def fit_by_correlation(t_a: FloatArray, a: FloatArray, t_b: FloatArray, b: FloatArray, where: str) -> Fit:
    """The best offset on a common grid by FFT, then offset and rate by least squares.

    The rate is kept only where its standard deviation is below 1e-3: a steady signal with one edge does not
    tell it.
    """
    step = max(t_a[-1] - t_a[0], t_b[-1] - t_b[0]) / GRID
    ga, va = _grid(t_a, a, step)
    gb, vb = _grid(t_b, b, step)
    if np.std(va) <= 1e-12 * np.max(np.abs(va)) or np.std(vb) <= 1e-12 * np.max(np.abs(vb)):
        raise InputError("a flat signal cannot be aligned by correlation", where=where)
    start = ga[0] - gb[0] + step * best_lag(va - va.mean(), vb - vb.mean())
    fit = _refined(ga, va, gb, vb, start, step)
    if not fit.quality >= MIN_QUALITY:
        raise InputError(
            f"the two records are not alike: correlation {fit.quality:.2f}, {MIN_QUALITY} wanted", where=where
        )
    return fit


def _grid(time: FloatArray, values: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Means over bins of one step, at the mean time of each bin; empty bins by interpolation."""
    place = np.floor((time - time[0]) / step).astype(np.int64)
    counts = np.bincount(place)
    centres = time[0] + (np.arange(len(counts)) + 0.5) * step
    filled = counts > 0
    means = np.bincount(place, values)[filled] / counts[filled]
    times = np.bincount(place, time)[filled] / counts[filled]
    return centres, np.interp(centres, times, means)


class _Pair:
    """Both gridded signals, and how well they fit for a shift and a stretch (in grid steps at the ends)."""

    def __init__(
        self, grids: tuple[FloatArray, FloatArray, FloatArray, FloatArray], start: float, step: float
    ) -> None:
        self.ga, self.va, self.gb, self.vb = grids
        self.start, self.step = start, step
        self.middle = 0.5 * (self.gb[0] + self.gb[-1])
        self.half = 0.5 * (self.gb[-1] - self.gb[0])

    def both(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The samples of the first signal inside the second, and the second there."""
        stretch = p[1] if len(p) > 1 else 0.0
        rate = 1.0 + stretch * self.step / self.half
        moved = self.start + p[0] * self.step + self.middle + rate * (self.gb - self.middle)
        inside = (self.ga >= moved[0]) & (self.ga <= moved[-1])
        return self.va[inside], np.interp(self.ga[inside], moved, self.vb)

    def residual(self, p: FloatArray) -> FloatArray:
        """What a straight line from the second to the first leaves, zero outside the overlap."""
        x, y = self.both(p)
        out = np.zeros(len(self.ga))
        if len(x) < 10 or np.ptp(y) <= 0.0:
            return out + np.std(self.va)
        dy = y - y.mean()
        out[: len(x)] = x - x.mean() - dy * (dy @ x) / (dy @ dy)
        return out

    def quality(self, p: FloatArray) -> float:
        """Correlation coefficient over the overlap."""
        x, y = self.both(p)
        alike = len(x) >= 10 and np.std(y) > 0.0 and np.std(x) > 0.0
        return float(np.corrcoef(x, y)[0, 1]) if alike else 0.0


def _gauss_newton(pair: _Pair, parameters: int) -> tuple[FloatArray, FloatArray]:
    """Parameters and covariance; differences over half a grid step, past the kinks of interpolation.

    To the noise is added how far apart in time the edges remain on the mean: two instruments do not
    see the same happening in quite the same shape, and no fit can tell that from a shift.
    """
    p = np.zeros(parameters)
    jac = np.zeros((len(pair.ga), parameters))
    for _ in range(5):
        for k in range(parameters):
            h = np.zeros(parameters)
            h[k] = 0.5
            jac[:, k] = pair.residual(p + h) - pair.residual(p - h)
        change = np.linalg.lstsq(jac, pair.residual(p), rcond=None)[0]
        p = p - np.clip(change, -5.0, 5.0)
        if np.max(np.abs(change)) < 1e-4:
            break
    rest = pair.residual(p)
    variance = float(rest @ rest) / max(len(rest) - 2 - parameters, 1) * correlation_time(rest)
    covariance = np.asarray(variance * np.linalg.pinv(jac.T @ jac))
    steep = np.abs(jac[:, 0]) > 0.05 * np.max(np.abs(jac[:, 0]))
    apart = float(np.sum(np.abs(rest[steep])) / max(np.sum(np.abs(jac[steep, 0])), 1e-300))
    return p, covariance + apart**2 * np.eye(parameters)


def _refined(
    ga: FloatArray, va: FloatArray, gb: FloatArray, vb: FloatArray, start: float, step: float
) -> Fit:
    pair = _Pair((ga, va, gb, vb), start, step)
    p, covariance = _gauss_newton(pair, 2)
    rate_std = float(np.sqrt(covariance[1, 1]) * step / pair.half)
    estimable = 0.0 < rate_std < RATE_STD_MAX and abs(p[1] * step / pair.half) < 0.01
    if not estimable:
        p, covariance = _gauss_newton(pair, 1)
    rate = 1.0 + p[1] * step / pair.half if estimable else 1.0
    offset = float(start + p[0] * step + pair.middle - rate * pair.middle)
    std = float(np.sqrt(covariance[0, 0]) * step)
    return Fit(offset, std, float(rate), rate_std if estimable else None, pair.quality(p))
