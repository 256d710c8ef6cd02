"""Figures of the response to the user's command: the mean that limits its jerk, then the drive behind it.

The mean over n samples (`actuator_lti.drive.profile`) is linear and acts on every command. As states it would
be a chain of n - 1; as a factor it has a closed form, falls from 1 to its first zero at 1/(n T), and is no
more than 0.22 behind it.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from actuator_lti.bandwidth import Bandwidth, closed_loop_bandwidth
from actuator_lti.drive.profile import CommandMean
from actuator_lti.margins.delays.form import delay_form, in_series
from actuator_lti.margins.distances import INVERSE
from actuator_lti.margins.factored import factored
from actuator_lti.margins.given import given_of
from actuator_lti.margins.loop import loop_of, rational_loop
from actuator_lti.step import StepFigures
from actuator_lti.systems.delay_response import DelayResponse
from actuator_lti.systems.root import root
from actuator_lti.types import Real

_OVER = 1e-9  # of the final value: less is no overshoot


def commanded_bandwidth(response: Any, mean: CommandMean) -> Bandwidth:
    """Bandwidths of a response, from the reference of the drive to what it moves, behind the command's mean.

    ``crossings_rad_s`` are those up to the first zero of the mean, below which the gain has fallen for
    certain; the phase is followed to that zero, where it turns by 180 deg.
    """
    own = closed_loop_bandwidth(response, mean.delay_s)
    zero_rad_s, turn = mean.first_zero_rad_s, own.minus90deg_rad_s
    end = zero_rad_s
    if own.resonance_peak_db > 13.0:  # the lobes behind the zero are 13.26 dB down: only then they matter
        end = max(end, 2.0 * own.resonance_rad_s)
    dc, level = abs(own.dc_gain), math.sqrt(0.5)
    if response.dt:
        gain = _Gain(response, mean, dc)
        crossings, (peak, place) = gain.crossings(level), gain.largest(end)
    else:
        has_delays = hasattr(response, "delays_s")
        form = delay_form(response) if has_delays else in_series(rational_loop(response), 0.0)
        late = DelayResponse.of(form).behind_mean(mean.samples, mean.period_s)
        crossings = late.crossings(dc * level, zero_rad_s)
        least, place = late.smallest(INVERSE, end)
        peak = 1.0 / (least * dc)
    peak_db = 20.0 * math.log10(peak)
    return replace(
        own, minus3db_rad_s=crossings[0], crossings_rad_s=tuple(crossings),
        minus90deg_rad_s=zero_rad_s if turn is None else min(turn, zero_rad_s),
        resonance_peak_db=peak_db if peak_db > 1e-9 else 0.0, resonance_rad_s=place if peak_db > 1e-9 else 0.0
    )  # fmt: skip


class _Gain:
    """The gain of a sampled response behind the mean, over its value at zero frequency.

    The mean over n samples is (z^n - 1)/(n (z - 1) z^(n-1)): n - 1 zeros on the unit circle, as many poles at
    z = 0, which join the factors of the response.
    """

    def __init__(self, response: Any, mean: CommandMean, dc: float) -> None:
        self.loop = loop_of(given_of(response), warp=True)
        self.mean, self.dc, n = mean, dc, mean.samples
        own, k = factored(self.loop), np.arange(1, n)
        zeros = 1j * np.tan(math.pi / n * k[2 * k != n])  # one at z = -1 lies at infinity
        roots, weights = np.append(zeros, -1.0), np.append(np.ones(zeros.size), 1.0 - n)
        self.factors = replace(
            own, roots=np.concatenate((own.roots, roots)), weights=np.concatenate((own.weights, weights)),
            log_gain=own.log_gain - math.log(dc) - float(np.log(np.abs(zeros)).sum())
        )  # fmt: skip

    def at(self, w: float) -> float:
        """The gain at w = tan(angle/2)."""
        own, mean = self.loop.at(np.array([w])), self.mean.response(np.array([self.loop.frequency(w)]))
        return float(np.abs(own * mean)[0]) / self.dc

    def _top(self, omega: float) -> float:
        return math.tan(min(0.5 * omega * self.mean.period_s, 0.5 * math.pi))

    def crossings(self, level: float) -> list[float]:
        """Where the gain passes a level, rad/s, up to the first zero of the mean; at least one."""
        top = self._top(self.mean.first_zero_rad_s)
        w = self.factors.passages(0.0, top, math.log(level))
        edges = np.array([0.0, *(0.5 * (w[1:] + w[:-1])), top])  # one passage between two of them
        pairs = zip(np.maximum(0.5 * w, edges[:-1]), np.minimum(2.0 * w, edges[1:]), strict=True)
        found = [root(lambda w: self.at(w) - level, *pair) for pair in pairs]
        return [self.loop.frequency(each) for each in found]

    def largest(self, end: float) -> tuple[float, float]:
        """The largest gain up to there and where, rad/s; (1, 0) where it only falls."""
        ((_, w),) = self.factors.nearest(self.factors.along(0.0, self._top(end)), (INVERSE,), ((1.0, 0.0),))
        return max((self.at(w), self.loop.frequency(w)), (1.0, 0.0))


def sampled_step(system: Any, samples: int) -> Real:
    """The first samples of the unit step response of a sampled system."""
    loop = rational_loop(system)
    state, y = np.zeros(loop.order), np.empty(samples)
    for k in range(samples):
        y[k] = float(state @ loop.c) + loop.d
        state = loop.A @ state + loop.b
    return y


def commanded_step(response: Any, own: StepFigures, mean: CommandMean) -> StepFigures:
    """Figures of a sampled response's step behind the mean: samples are means of the last n of the step.

    ``own`` are those of the response itself; it has settled before the end of its own time.
    """
    period = float(own.period_s or 0.0)
    count = round(float(own.time_s[-1]) / period) + 1 + mean.samples
    total = np.cumsum(sampled_step(response, count))
    total[mean.samples :] -= total[: -mean.samples].copy()
    part = total / mean.samples / own.final_value
    outside = np.flatnonzero(np.abs(part - 1.0) > 0.02)
    rise = (int(np.argmax(part >= 0.9)) - int(np.argmax(part >= 0.1))) * period
    peak = int(np.argmax(part))
    over = 100.0 * (part[peak] - 1.0)
    return replace(
        own, rise_time_s=rise, overshoot_percent=float(over) if over > 100.0 * _OVER else 0.0,
        settling_time_s=(int(outside[-1]) + 1) * period if outside.size else 0.0,
        peak_value=float(part[peak] * own.final_value), peak_time_s=peak * period,
        time_s=np.arange(count) * period, response=part * own.final_value
    )  # fmt: skip
