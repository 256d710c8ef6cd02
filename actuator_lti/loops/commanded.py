"""Figures of the response to the user's command: the mean that limits its jerk, then the drive behind it.

The mean over n samples (`actuator_lti.drive.profile`) is linear and acts on every command. As states it would
be a chain of n - 1; as a factor it has a closed form, falls from 1 to its first zero at 1/(n T), and is no
more than 0.22 behind it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq

from actuator_lti.bandwidth import Bandwidth, closed_loop_bandwidth
from actuator_lti.drive.profile import CommandMean
from actuator_lti.margins.delays.form import delay_form
from actuator_lti.margins.distances import INVERSE
from actuator_lti.margins.factored import factored
from actuator_lti.margins.given import given_of
from actuator_lti.margins.loop import Real, loop_of, rational_loop
from actuator_lti.step import StepFigures
from actuator_lti.systems.delay_response import DelayResponse

_NARROW = 1e-6  # of the frequency: what is decided by a sign at both ends of so small an interval
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
    if hasattr(response, "delays_s") and response.delays_s.size:
        late = DelayResponse.of(delay_form(response)).behind_mean(mean.samples, mean.period_s)
        crossings = late.crossings(abs(own.dc_gain) * math.sqrt(0.5), zero_rad_s)
        least, place = late.smallest(INVERSE, end)
        peak = 1.0 / (least * abs(own.dc_gain))
    else:
        gain = _Gain(response, mean, abs(own.dc_gain))
        crossings = gain.crossings(math.sqrt(0.5))
        peak, place = gain.largest(end)
    peak_db = 20.0 * math.log10(peak)
    return replace(
        own,
        minus3db_rad_s=crossings[0],
        crossings_rad_s=tuple(crossings),
        minus90deg_rad_s=zero_rad_s if turn is None else min(turn, zero_rad_s),
        resonance_peak_db=peak_db if peak_db > 1e-9 else 0.0,
        resonance_rad_s=place if peak_db > 1e-9 else 0.0,
    )


class _Gain:
    """The gain behind the mean over its value at zero frequency, bounded over intervals of frequency."""

    def __init__(self, response: Any, mean: CommandMean, dc: float) -> None:
        if hasattr(response, "delays_s"):
            response = response.to_state_space()
        self._loop = loop_of(given_of(response), warp=True)
        self.factors = factored(self._loop)
        self.mean, self.dc = mean, dc

    def w(self, omega: float) -> float:
        """The argument of the factors."""
        period = self._loop.period_s
        return omega if period is None else math.tan(min(0.5 * omega * period, 0.5 * math.pi))

    def omega(self, w: Real) -> Real:
        """Angular frequency, rad/s."""
        period = self._loop.period_s
        return w if period is None else 2.0 * np.arctan(w) / period

    def at(self, w: float) -> float:
        """The gain."""
        own = abs(complex(self._loop.at(np.array([w]))[0]))
        return own / self.dc * abs(complex(self.mean.response(self.omega(np.array([w])))[0]))

    def bounds(self, low_w: Real, high_w: Real) -> tuple[Real, Real]:
        """No less and no more than this inside each interval: the mean falls up to its first zero."""
        own = np.array(self.factors.gain_bounds(low_w, high_w)) / self.dc
        low, high = self.omega(low_w), self.omega(high_w)
        before = high <= self.mean.first_zero_rad_s
        least = np.where(before, np.abs(self.mean.response(high)), 0.0)
        half = 0.5 * low * self.mean.period_s
        with np.errstate(divide="ignore"):
            lobe = 1.0 / (self.mean.samples * np.abs(np.sin(np.minimum(half, 0.5 * math.pi))))
        most = np.where(before, np.abs(self.mean.response(low)), np.minimum(lobe, 1.0))
        return own[0] * least, own[1] * most

    def _split(self, end: float, resolved: Any) -> Real:
        """Intervals up to there, resolved or narrow: low, high and most gain, in order; shape (3, k)."""
        places = self.factors.places
        edges = np.concatenate(([0.0], places[places < self.w(end)], [self.w(end)]))
        low, high, done = edges[:-1], edges[1:], []
        while low.size:
            least, most = self.bounds(low, high)
            good = resolved(least, most) | (high - low < _NARROW * high)
            done.append(np.array((low, high, most))[:, good])
            low, high = low[~good], high[~good]
            middle = 0.5 * (low + high)
            low, high = np.append(low, middle), np.append(middle, high)
        found = np.concatenate(done, axis=1)
        return found[:, found[0].argsort()]

    def crossings(self, level: float) -> list[float]:
        """Where the gain passes a level, rad/s, up to the first zero of the mean; at least one."""
        _, high, _ = self._split(
            self.mean.first_zero_rad_s, lambda least, most: (least > level) | (most < level)
        )
        edges = [0.0, *high.tolist()]
        pairs = [(a, b) for a, b in pairwise(edges) if (self.at(a) > level) != (self.at(b) > level)]
        found = [brentq(lambda w: self.at(w) - level, *pair, xtol=1e-300, rtol=1e-14) for pair in pairs]
        return self.omega(np.array(found)).tolist()

    def largest(self, end: float) -> tuple[float, float]:
        """The largest gain up to there and where, rad/s; (1, 0) where it only falls."""
        best = [1.0]

        def beaten(least: Real, most: Real) -> Any:
            best[0] = max(best[0], float(least.max(initial=0.0)))
            return most <= best[0]

        low, high, most = self._split(end, beaten)
        near = 0.5 * (low + high)[most >= best[0]]
        w = max(near.tolist(), key=self.at, default=0.0)
        return (self.at(w), float(self.omega(np.array(w)))) if w and self.at(w) > 1.0 else (1.0, 0.0)


def commanded_step(response: Any, own: StepFigures, mean: CommandMean) -> StepFigures:
    """Figures of a sampled response's step behind the mean: samples are means of the last n of the step.

    ``own`` are those of the response itself; it has settled before the end of its own time.
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
