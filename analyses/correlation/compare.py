"""One signal, measured and modelled: the figures that say how alike they are."""

from dataclasses import dataclass, field
from math import isnan

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.estimation.means import best_lag


@dataclass(frozen=True, kw_only=True)
class SignalComparison:
    """How far a modelled signal is from the measured one.

    ``relative_error`` is the norm of the difference over the norm of the measured; ``fit_percent`` is
    ``100 (1 - norm of the difference / norm of the measured about its mean)``; ``max_error`` is the largest
    absolute difference, at ``max_error_time_s``; ``mean_error`` the mean of the absolute difference,
    ``rms_error`` its root mean square. ``delay_s`` is by how much the measured signal comes later
    than the model (negative: earlier), the shift that fits best; None where the signal does not tell.
    """

    name: str
    unit: str
    samples: int
    relative_error: float
    fit_percent: float
    mean_error: float
    rms_error: float
    max_error: float
    max_error_time_s: float
    delay_s: float | None
    time_s: Floats = field(repr=False)
    measured: Floats = field(repr=False)
    modelled: Floats = field(repr=False)

    @property
    def share_of_motion(self) -> float:
        """Norm of the difference over that of the measured about its mean; of a flat signal over its norm."""
        return self.relative_error if isnan(self.fit_percent) else 1.0 - self.fit_percent / 100.0


def compare_signals(
    name: str, unit: str, time_s: Floats, measured: Floats, modelled: Floats
) -> SignalComparison:
    """Compare two signals sampled at the same times.

    Raises `InputError`: for signals of different shape, fewer than two samples, values that are not finite,
    or a measured signal that is zero throughout.

    >>> t = np.linspace(0.0, 1.0, 1001)
    >>> c = compare_signals("speed", "rad/s", t, np.sin(6.0 * (t - 0.01)), np.sin(6.0 * t))
    >>> round(c.delay_s, 4)
    0.01
    """
    if not (time_s.shape == measured.shape == modelled.shape) or len(time_s) < 2:
        shapes = f"{time_s.shape}, {measured.shape}, {modelled.shape}"
        raise InputError(f"{name}: time, measured and modelled have the shapes {shapes}")
    if not (np.isfinite(measured).all() and np.isfinite(modelled).all()):
        raise InputError(f"{name}: values that are not finite")
    norm = float(np.linalg.norm(measured))
    if norm == 0.0:
        raise InputError(f"{name}: the measured signal is zero throughout")
    difference = modelled - measured
    about_mean = float(np.linalg.norm(measured - measured.mean()))
    worst = int(np.argmax(np.abs(difference)))
    size = float(np.linalg.norm(difference))
    return SignalComparison(
        name=name,
        unit=unit,
        samples=len(measured),
        relative_error=size / norm,
        fit_percent=100.0 * (1.0 - size / about_mean) if about_mean > 1e-9 * norm else float("nan"),
        mean_error=float(np.mean(np.abs(difference))),
        rms_error=float(np.sqrt(np.mean(difference**2))),
        max_error=float(abs(difference[worst])),
        max_error_time_s=float(time_s[worst]),
        delay_s=delay_between(time_s, measured, modelled),
        time_s=time_s,
        measured=measured,
        modelled=modelled,
    )


def delay_between(time_s: Floats, measured: Floats, modelled: Floats) -> float | None:
    """The shift in s by which the modelled signal is to be moved later to fit the measured one best.

    By cross-correlation (FFT) on a regular grid to the sample, then to a fraction by least squares on the
    slope of the model. None for flat signals, and where the best shift is a quarter of the record or more.
    """
    period = float(np.median(np.diff(time_s)))
    grid = np.arange(time_s[0], time_s[-1] + 0.5 * period, period)
    a, b = np.interp(grid, time_s, measured), np.interp(grid, time_s, modelled)
    if any(np.ptp(one) <= 1e-12 * np.max(np.abs(one), initial=0.0) for one in (a, b)):
        return None
    lag = best_lag(a - a.mean(), b - b.mean())
    if abs(lag) >= len(grid) // 4:
        return None
    shift = lag * period
    for _ in range(5):
        moved = np.interp(grid, grid + shift, b)
        slope = np.gradient(moved, period)
        power = float(slope @ slope)
        if power == 0.0:
            return None
        step = -float(slope @ (a - moved)) / power
        shift += float(np.clip(step, -period, period))
        if abs(step) < 1e-6 * period:
            break
    return float(shift)
