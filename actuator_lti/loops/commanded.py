"""Figures of the response to the user's command: the mean that limits its jerk, then the drive behind it.

The mean over n samples (`actuator_lti.drive.profile`) is linear and acts on every command. As states it would
be a chain of n - 1; as a factor it has a closed form, falls from 1 to its first zero at 1/(n T), and is no
more than 0.22 behind it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from actuator_lti.bandwidth import Bandwidth, closed_loop_bandwidth
from actuator_lti.drive.profile import CommandMean
from actuator_lti.margins.delay_form import DelayForm, Intervals, border_values, delay_form, from_rational
from actuator_lti.margins.delay_setting import low_frequency
from actuator_lti.margins.loop import Mask, rational_loop
from actuator_lti.margins.sweep import subdivided, variation
from actuator_lti.step import StepFigures

_NARROW = 1e-6  # of the frequency: what is decided by a sign at both ends of so small an interval
_OVER = 1e-9  # of the final value: less is no overshoot


def commanded_bandwidth(response: Any, mean: CommandMean) -> Bandwidth:
    """Bandwidths of a response behind the mean of its command.

    Parameters
    ----------
    response : PlainSystem, DelaySystem or python-control system
        From the reference of the drive to what it moves.
    mean : CommandMean

    Returns
    -------
    Bandwidth
        ``crossings_rad_s`` are those up to the first zero of the mean, below which the gain has fallen for
        certain; the phase is followed to that zero, where it turns by 180 deg.

    Raises
    ------
    InputError
        As `closed_loop_bandwidth`.
    """
    own = closed_loop_bandwidth(response, mean.delay_s)
    gain = _Gain(response, mean, abs(own.dc_gain))
    crossings = gain.crossings(math.sqrt(0.5))
    turn = own.minus90deg_rad_s
    peak, place = gain.largest(own)
    peak_db = 20.0 * math.log10(peak)
    return replace(
        own,
        minus3db_rad_s=crossings[0],
        crossings_rad_s=tuple(crossings),
        minus90deg_rad_s=gain.zero_rad_s if turn is None else min(turn, gain.zero_rad_s),
        resonance_peak_db=peak_db if peak_db > 1e-9 else 0.0,
        resonance_rad_s=place if peak_db > 1e-9 else 0.0,
    )


class _Gain:
    """The gain behind the mean over its value at zero frequency, bounded over intervals of frequency."""

    def __init__(self, response: Any, mean: CommandMean, dc: float) -> None:
        if hasattr(response, "delays_s") and not response.delays_s.size:
            response = response.to_state_space()
        delayed = hasattr(response, "delays_s")
        form = delay_form(response) if delayed else from_rational(rational_loop(response), 0.0)
        self.form: DelayForm = form
        self.mean, self.dc = mean, dc
        self.unit = 1.0 if form.period_s is None else 1.0 / form.period_s
        self.zero_rad_s = 2.0 * math.pi / (mean.samples * mean.period_s)

    def at(self, x: float) -> float:
        """The gain at x (rad/s over `unit`)."""
        own = abs(complex(border_values(self.form, np.array([x]))[0]))
        return own / self.dc * abs(complex(self.mean.response(np.array([x * self.unit]))[0]))

    def bounds(self, intervals: Intervals) -> tuple[np.ndarray, np.ndarray]:
        """No less and no more than this inside each interval: the mean falls up to its first zero."""
        size, R = np.abs(intervals.L), variation(self.form, intervals)
        low, high = (intervals.x + side * intervals.half for side in (-1.0, 1.0))
        before = high * self.unit <= self.zero_rad_s
        least = np.where(before, np.abs(self.mean.response(high * self.unit)), 0.0)
        half = 0.5 * low * self.unit * self.mean.period_s
        with np.errstate(divide="ignore"):
            lobe = 1.0 / (self.mean.samples * np.abs(np.sin(np.minimum(half, 0.5 * math.pi))))
        most = np.where(before, np.abs(self.mean.response(low * self.unit)), np.minimum(lobe, 1.0))
        return np.maximum(size - R, 0.0) / self.dc * least, (size + R) / self.dc * most

    def _split(self, end: float, resolved: Any) -> Intervals:
        low, _ = low_frequency(self.form)

        def narrow_or(intervals: Intervals) -> Mask:
            return np.asarray(resolved(*self.bounds(intervals)) | (intervals.half < _NARROW * intervals.x))

        return subdivided(self.form, np.geomspace(min(low, 1e-3 * end), end, 12), narrow_or)

    def crossings(self, level: float) -> list[float]:
        """Where the gain passes a level, rad/s, up to the first zero of the mean; at least one."""
        end = self.zero_rad_s / self.unit
        intervals = self._split(end, lambda least, most: (least > level) | (most < level))
        edges = [float(intervals.x[0] - intervals.half[0]), *(intervals.x + intervals.half).tolist()]
        signs = [self.at(x) > level for x in edges]
        pairs = [k for k in range(len(edges) - 1) if signs[k] != signs[k + 1]]
        found = [
            brentq(lambda x: self.at(x) - level, edges[k], edges[k + 1], xtol=1e-300, rtol=1e-14)
            for k in pairs
        ]
        return [float(x) * self.unit for x in found]

    def largest(self, own: Bandwidth) -> tuple[float, float]:
        """The largest gain and where, rad/s; (1, 0) where it only falls."""
        end = self.zero_rad_s / self.unit
        if own.resonance_peak_db > 13.0:  # the lobes behind the zero are 13.26 dB down: only then they matter
            end = math.pi if self.form.sampled else max(end, 2.0 * own.resonance_rad_s)
        best = [1.0]

        def beaten(least: np.ndarray, most: np.ndarray) -> Mask:
            best[0] = max(best[0], float(least.max(initial=0.0)))
            return np.asarray(most <= best[0])

        intervals = self._split(end, beaten)
        _, most = self.bounds(intervals)
        near = intervals.x[most >= best[0]]
        x = max(near.tolist(), key=self.at, default=0.0)
        return (self.at(x), x * self.unit) if x and self.at(x) > 1.0 else (1.0, 0.0)


def commanded_step(response: Any, own: StepFigures, mean: CommandMean) -> StepFigures:
    """Figures of the step behind the mean, at samples: each is the mean of the last n of the step itself.

    Parameters
    ----------
    response : PlainSystem or python-control system
        Sampled.
    own : StepFigures
        Of that response; it has settled before the end of its own time.
    """
    period = float(own.period_s or 0.0)
    loop, count = rational_loop(response), round(float(own.time_s[-1]) / period) + 1 + mean.samples
    state, y = np.zeros(loop.order), np.empty(count)
    for k in range(count):
        y[k] = float(state @ loop.c) + loop.d
        state = loop.A @ state + loop.b
    total = np.cumsum(y)
    total[mean.samples :] -= total[: -mean.samples].copy()
    part = total / mean.samples / own.final_value
    outside = np.flatnonzero(np.abs(part - 1.0) > 0.02)
    rise = (int(np.argmax(part >= 0.9)) - int(np.argmax(part >= 0.1))) * period
    peak = int(np.argmax(part))
    over = 100.0 * (part[peak] - 1.0)
    return replace(
        own,
        rise_time_s=rise,
        overshoot_percent=float(over) if over > 100.0 * _OVER else 0.0,
        settling_time_s=(int(outside[-1]) + 1) * period if outside.size else 0.0,
        peak_value=float(part[peak] * own.final_value),
        peak_time_s=peak * period,
        time_s=np.arange(count) * period,
        response=part * own.final_value,
    )
