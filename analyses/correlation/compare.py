"""One signal, measured and modelled: the figures that say how alike they are."""

from dataclasses import dataclass, field
from math import comb, isnan

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.estimation.series import best_lag
from analyses.records.finding import SURE
from analyses.records.single_rows import NORMAL

ORDERS = (1, 2, 4)  # of the differences in which noise shows
LEAST_ROWS = 100
CHANCE = 2.0 * comb(16, 8) / comb(8, 4) ** 2
"""Variance of s^2 by the fourth differences of n rows, times n over s^4: 2 sum (C(8, 4+k)/C(8, 4))^2."""


@dataclass(frozen=True, kw_only=True)
class SignalComparison:
    """How far a modelled signal is from the measured one."""

    name: str
    unit: str
    samples: int
    relative_error: float  # norm of the difference over the norm of the measured
    fit_percent: float  # 100 (1 - norm of the difference / norm of the measured about its mean)
    # Of the absolute difference: mean, root mean square, largest and where that is
    mean_error: float
    rms_error: float
    max_error: float
    max_error_time_s: float
    # By how much the measured signal comes later than the model (negative: earlier), by the best fit;
    # None where the signal does not tell
    delay_s: float | None
    noise_rms: float  # white noise that the measured signal shows from row to row, 0 where it shows none
    counts_rms: float  # of the difference, what an encoder's counts make at another phase in both
    time_s: Floats = field(repr=False)
    measured: Floats = field(repr=False)
    modelled: Floats = field(repr=False)

    @property
    def share_of_motion(self) -> float:
        """Norm of the difference over that of the measured about its mean; of a flat signal over its norm."""
        return self.relative_error if isnan(self.fit_percent) else 1.0 - self.fit_percent / 100.0

    @property
    def left_by_noise(self) -> float:
        """The part of each error that the measured signal's own noise and counts do not explain, 0 to 1.

        As much of a white noise counts as there surely is, by chance in so many samples.
        """
        if not self.noise_rms and not self.counts_rms:
            return 1.0
        sure = max(1.0 - SURE * np.sqrt(CHANCE / self.samples), 0.0)
        explained = sure * self.noise_rms**2 + self.counts_rms**2
        return float(np.sqrt(max(1.0 - explained / self.rms_error**2, 0.0)))

    @property
    def share_beyond_noise(self) -> float:
        """The share of the motion without that noise, which no model can have."""
        return self.left_by_noise * self.share_of_motion


def compare_signals(
    name: str,
    unit: str,
    time_s: Floats,
    measured: Floats,
    modelled: Floats,
    uncounted: Floats | None = None,
) -> SignalComparison:
    """Compare two signals sampled at the same times; ``uncounted``: the modelled one without counts.

    Raises `InputError`: for a measured signal that is zero throughout.

    >>> t = np.linspace(0.0, 1.0, 1001)
    >>> c = compare_signals("speed", "rad/s", t, np.sin(6.0 * (t - 0.01)), np.sin(6.0 * t))
    >>> round(c.delay_s, 4)
    0.01
    """
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
        noise_rms=white_noise(measured, difference),
        counts_rms=0.0 if uncounted is None else counted_part(difference, modelled - uncounted),
        time_s=time_s,
        measured=measured,
        modelled=modelled,
    )


def counted_part(difference: Floats, ripple: Floats) -> float:
    """The rms of what an encoder's counts make of a difference: the ripple of a loop that they excite.

    A record has as much of it as the model, at a phase that nobody knows. Without the model's the difference
    d is d - r, of which r^2 is the record's own: of d^2 all but (d - r)^2 - r^2 is 2 r d; of two ripples
    turned against each other 4 r^2, of which no more can be.

    >>> t = np.linspace(0.0, 1.0, 1000, endpoint=False)
    >>> model, record = (np.sin(2.0 * np.pi * (50.0 * t + turn)) for turn in (0.0, 0.25))
    >>> round(counted_part(model - record, model), 6), round(float(np.std(model - record)), 6)
    (1.0, 1.0)
    """
    both, own = float(np.mean(ripple * difference)), float(np.mean(ripple**2))
    return float(np.sqrt(min(max(2.0 * both, 0.0), 4.0 * own)))


def white_noise(measured: Floats, difference: Floats) -> float:
    """The rms of the white noise in a measured signal; 0 where what changes from row to row is not white.

    The k-th differences of white noise of variance s^2 have the variance C(2k, k) s^2, those of anything
    slower less the higher k is (von Neumann, 1941). The noise is the least that the difference to the model
    has by any of them, and no more than the measured signal alone shows, single rows aside (median). Of a
    ripple the variances of higher orders differ beyond chance: no noise then.

    >>> noise = 0.1 * np.random.default_rng(1).standard_normal(5000)
    >>> slow = np.sin(np.linspace(0.0, 20.0, 5000))
    >>> round(white_noise(slow + noise, 0.5 * slow + noise), 2), white_noise(slow, 0.5 * slow) < 1e-6
    (0.1, True)
    """
    if len(difference) < LEAST_ROWS or not np.any(difference):
        return 0.0
    each = [float(np.mean(np.diff(difference, k) ** 2)) / comb(2 * k, k) for k in ORDERS]
    spread = NORMAL * float(np.median(np.abs(np.diff(measured, ORDERS[-1]))))
    own = spread**2 / comb(2 * ORDERS[-1], ORDERS[-1])
    first, second, last = each
    chance = SURE * np.sqrt(CHANCE / len(difference))
    white = abs(last - second) <= chance * second and max(second, last) <= (1.0 + chance) * first
    return float(np.sqrt(min(*each, own))) if white else 0.0


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
