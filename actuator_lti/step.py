"""Step response and its figures: rise, overshoot, settling."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from actuator_lti.errors import InputError
from actuator_lti.margins.loop import Real, rational_loop
from actuator_lti.step_delayed import delayed_response
from actuator_lti.step_exact import exact_response
from actuator_lti.step_search import Search, outside
from actuator_lti.step_terms import Exponentials

_SHOWN = 4000
_OVER = 1e-9  # an excess below this part of the final value is no overshoot


@dataclass(frozen=True)
class StepFigures:
    """Figures of a unit step response.

    Attributes
    ----------
    rise_time_s : float
        From 10 to 90 % of the final value, first passages.
    overshoot_percent : float
        Largest excess over the final value, % of it; 0 where there is none.
    settling_time_s : float
        From when on the response stays within 2 % of the final value.
    final_value : float
        Limit of the response.
    peak_value, peak_time_s : float
        The largest value (in the direction of the final one) and when it is reached; where the response only
        approaches its final value from below, that value and infinity.
    period_s : float or None
        Sampling period: the figures of a sampled system are times of samples.
    time_s, response : arrays (m,)
        The response to look at, until well after settling.
    notes : tuple of str
        What else has to be known to read the figures.
    """

    rise_time_s: float
    overshoot_percent: float
    settling_time_s: float
    final_value: float
    peak_value: float
    peak_time_s: float
    period_s: float | None
    time_s: Real
    response: Real
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        return (
            f"rise 10-90 % {self.rise_time_s:.6g} s, overshoot {self.overshoot_percent:.4f} %, "
            f"settling 2 % {self.settling_time_s:.6g} s, final value {self.final_value:.6g}"
        )


def step_figures(system: Any) -> StepFigures:
    """Figures of the unit step response of a stable system.

    A rational system is taken exactly as its doubles say: the response is the sum over certified poles, and
    every figure is found by branch and bound over all times, so that nothing hides between two points of a
    grid. A sampled system is looked at at its samples. A system with inner delays is stepped along its first
    delays, the delayed signals parabolas over steps of which at least 12 make the shortest one, and is then
    the sum over its exact poles.

    All figures are relative to the final value, however small it is beside what comes before: a resonance
    80 dB above the gain at zero frequency gives an overshoot of a million percent.

    Parameters
    ----------
    system : StateSpace, TransferFunction or DelaySystem
        One input, one output; a closed loop.

    Raises
    ------
    InputError
        The system is not stable, or its final value is zero.
    NumericalError
        The final value is lost in the rounding of the entries, or when it settles cannot be told.

    Examples
    --------
    >>> import control
    >>> print(step_figures(control.tf([1], [1, 1])))
    rise 10-90 % 2.19722 s, overshoot 0.0000 %, settling 2 % 3.91202 s, final value 1
    """
    if hasattr(system, "delays_s"):
        if system.delays_s.size:
            return _figures(*delayed_response(system))
        system = system.to_state_space()
    loop = rational_loop(system)
    exact = exact_response(system, loop)
    scale = 1.0 if loop.period_s is None else loop.period_s
    response = _Response(Exponentials(exact.terms, exact.final, exact.bits), exact.first / exact.final,
                         loop.in_z)  # fmt: skip
    ten, ninety, settled = response.reached(0.1), response.reached(0.9), response.settled()
    peak, at = response.peak()
    time = response.shown(ninety, settled)
    return StepFigures(
        (ninety - ten) * scale, max(100.0 * (peak - 1.0), 0.0), settled * scale, exact.final,
        peak * exact.final, at * scale, loop.period_s, time * scale, response.at(time) * exact.final,
        exact.notes,
    )  # fmt: skip


@dataclass(frozen=True)
class _Response:
    """The response over its final value: its first samples, then its exponentials; time in s or samples."""

    later: Exponentials
    first: Real
    whole: bool

    @property
    def _search(self) -> Search:
        return Search(self.later, float(self.first.size), self.whole)

    def reached(self, level: float) -> float:
        """First time at or above a level."""
        early = np.flatnonzero(self.first >= level)
        if early.size or self.later.empty:
            return float(early[0]) if early.size else float(self.first.size)
        return self._search.first_at_least(level)

    def settled(self) -> float:
        """From when on the response stays within the band."""
        last = None if self.later.empty else self._search.last_outside()
        if last is None:
            early = np.flatnonzero(outside(self.first))
            return float(early[-1]) + 1.0 if early.size else 0.0
        return last + 1.0 if self.whole else last

    def peak(self) -> tuple[float, float]:
        """Largest value and when; 1 and infinity where it is never above the final value."""
        best, place = 1.0 + _OVER, float("inf")
        if self.first.size and self.first.max() > best:
            place = float(self.first.argmax())
            best = float(self.first.max())
        if not self.later.empty:
            found, at = self._search.greatest(best)
            if found > best:
                best, place = found, self.later.top(at) if not self.whole and at > 0.0 else at
        return (best, place) if np.isfinite(place) else (1.0, place)

    def at(self, time: Real) -> Real:
        """The response at the times given."""
        y = np.empty(time.size)
        early = time < self.first.size
        y[early] = self.first[time[early].astype(int)]
        y[~early] = 1.0 if self.later.empty else self.later.values(time[~early])
        return y

    def shown(self, ninety: float, settled: float) -> Real:
        """Times to look at the response, until well after settling; close together while it rises."""
        end = 2.0 * settled if settled > 0.0 else 2.0 * ninety
        if end == 0.0:
            end = 1.0 if self.later.empty else 5.0 / self.later.slowest
        end = max(end, float(self.first.size))
        rising = np.linspace(0.0, min(5.0 * ninety, end), _SHOWN // 4) if ninety > 0.0 else np.zeros(1)
        time = np.concatenate((rising, np.linspace(0.0, end, _SHOWN - rising.size)))
        return np.unique(np.ceil(time) if self.whole else time)


def _located(time: Real, between: Callable[[int, float], float], k: int, level: float) -> float:
    """Where the response passes a level between grid points k and k + 1."""
    low, high = between(k, float(time[k])) - level, between(k, float(time[k + 1])) - level
    if low * high >= 0.0:
        return float(time[k] if abs(low) < abs(high) else time[k + 1])
    return float(brentq(lambda t: between(k, t) - level, time[k], time[k + 1], xtol=1e-300, rtol=1e-13))


def _passage(time: Real, y: Real, between: Callable[[int, float], float], level: float) -> float:
    k = int(np.argmax(y >= level))
    return float(time[0]) if k == 0 else _located(time, between, k - 1, level)


def _figures(time: Real, response: Real, final: float, between: Callable[[int, float], float]) -> StepFigures:
    y = response / final

    def scaled(k: int, t: float) -> float:
        return between(k, t) / final

    rise = _passage(time, y, scaled, 0.9) - _passage(time, y, scaled, 0.1)
    outside = np.flatnonzero(np.abs(y - 1.0) > 0.02)
    settling = 0.0
    if outside.size:
        k = int(outside[-1])
        if k + 1 >= y.size:
            raise InputError("the step response does not settle in the time that its poles announce")
        settling = _located(time, scaled, k, 1.02 if y[k] > 1.0 else 0.98)
    peak, at = _peak(time, y, scaled)
    keep = _shown(time, settling)
    return StepFigures(rise, max(100.0 * (peak - 1.0), 0.0), settling, final, peak * final, at, None,
                       time[keep], response[keep])  # fmt: skip


def _peak(time: Real, y: Real, between: Callable[[int, float], float]) -> tuple[float, float]:
    k = int(y.argmax())
    if y[k] <= 1.0 + 1e-9:
        return 1.0, float("inf")
    if k in (0, y.size - 1):
        return float(y[k]), float(time[k])

    def below(t: float) -> float:
        return -between(k - 1 if t < time[k] else k, t)

    found = minimize_scalar(below, bounds=(time[k - 1], time[k + 1]), method="bounded",
                            options={"xatol": 1e-10 * float(time[k + 1])})  # fmt: skip
    return (-float(found.fun), float(found.x)) if -found.fun > y[k] else (float(y[k]), float(time[k]))


def _shown(time: Real, settling: float) -> np.ndarray:
    last = int(np.searchsorted(time, 2.0 * settling)) if settling > 0.0 else time.size
    count = max(min(last + 1, time.size), 2)
    return np.unique(np.linspace(0, count - 1, min(count, _SHOWN)).astype(int))
