"""The steady part of a run, by a stated criterion on the acceleration."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.records.record import longest


@dataclass(frozen=True, kw_only=True)
class SteadyCriterion:
    """When a motion counts as steady: where its acceleration is not above the larger of two limits.

    The acceleration is the slope of a least-squares line through the speed; the longest stretch is taken.
    """

    window_s: float = 0.25  # of that line
    relative_per_s: float = 0.02  # times the plateau of the speed, its 95 % point: one limit
    noise_factor: float = 5.0  # times what white noise of the speed gives such a slope (std): the other
    least_share: float = 0.5  # of the plateau: samples below are standstill
    trim_s: float = 0.1  # cut off at both ends
    least_duration_s: float = 0.5  # must remain

    def __str__(self) -> str:
        said = f"slope of the speed over {self.window_s:g} s at most {100 * self.relative_per_s:g} % of the "
        said += f"plateau per second (or {self.noise_factor:g} standard deviations of its noise), "
        return said + f"longest stretch, under its load, {self.trim_s:g} s cut off at both ends"


CRITERION = SteadyCriterion()


@dataclass(frozen=True)
class SteadyWindow:
    """The part of a record that counts as steady: rows ``start:stop``, and the limit that was applied."""

    start: int
    stop: int
    start_s: float
    stop_s: float
    limit_rad_s2: float
    largest_acceleration_rad_s2: float


def find_steady_window(
    time_s: Floats, speed_rad_s: Floats, criterion: SteadyCriterion = CRITERION, load: Floats | None = None
) -> SteadyWindow:
    """The steady part of a run, which may be sampled irregularly.

    Of a ``load`` that comes or goes in steady motion it is the part under load: where its mean over the
    criterion's window is above half of its plateau, if that is long enough.
    """
    period = float(np.median(np.diff(time_s)))
    samples = max(round(criterion.window_s / period), 4)
    if len(time_s) < 2 * samples:
        raise InputError(f"no steady part: the record of {len(time_s)} samples is shorter than two windows")
    slope = moving_slope(time_s, speed_rad_s, samples)
    plateau = float(np.quantile(np.abs(speed_rad_s), 0.95))
    steps = np.abs(np.diff(speed_rad_s))  # white noise: from neighbours without the largest 1 %
    noise = float(np.sqrt(np.mean(steps[steps <= np.quantile(steps, 0.99)] ** 2) / 2.0))
    noise *= np.sqrt(12.0 / (samples * (samples**2 - 1.0)))
    limit = max(criterion.relative_per_s * plateau, criterion.noise_factor * (noise / period))
    half, trim = samples // 2, round(criterion.trim_s / period)
    moving = np.abs(speed_rad_s[half : half + len(slope)]) >= criterion.least_share * plateau
    calm, least = (np.abs(slope) <= limit) & moving, max(criterion.least_duration_s / period, 8.0)
    start, stop = longest(calm)
    if load is not None and np.any(calm):
        loaded = longest(calm & _under_load(load, calm, samples))
        start, stop = loaded if loaded[1] - loaded[0] - 2 * trim >= least else (start, stop)
    start, stop = start + half + trim, stop + half - trim
    if stop - start < least:
        calmest = float(np.min(np.abs(slope[moving]), initial=np.inf))
        why = f"the smallest acceleration is {calmest:.3g} rad/s2, the limit {limit:.3g} rad/s2"
        raise InputError(f"no steady part of {criterion.least_duration_s:g} s: {why}")
    largest = float(np.max(np.abs(slope[start - half : stop - half])))
    return SteadyWindow(start, stop, float(time_s[start]), float(time_s[stop - 1]), float(limit), largest)


def _under_load(load: Floats, calm: NDArray[np.bool_], samples: int) -> NDArray[np.bool_]:
    """Where the mean over the samples around is above half of its plateau, the 95 % point in calm motion."""
    total = np.concatenate([[0.0], np.cumsum(load)])
    mean = np.abs(total[samples:] - total[:-samples]) / samples
    return np.asarray(mean >= 0.5 * np.quantile(mean[calm], 0.95))


def moving_slope(time_s: Floats, values: Floats, samples: int) -> Floats:
    """Slope of the least-squares line over every ``samples`` neighbours, shape (n - samples + 1,).

    >>> t = np.array([0.0, 0.1, 0.25, 0.3, 0.45, 0.5])
    >>> moving_slope(t, 3.0 * t + 1.0, 4).round(12).tolist()
    [3.0, 3.0, 3.0]
    """
    t, x = time_s - time_s.mean(), values - values.mean()
    totals = [np.concatenate([[0.0], np.cumsum(part)]) for part in (t, x, t * x, t * t)]
    st, sx, stx, stt = (total[samples:] - total[:-samples] for total in totals)
    return np.asarray((samples * stx - st * sx) / (samples * stt - st * st))
