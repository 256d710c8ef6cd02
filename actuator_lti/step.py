"""Step response and its figures: rise, overshoot, settling."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from actuator_lti.errors import InputError
from actuator_lti.margins.loop import RationalLoop, Real, rational_loop
from actuator_lti.margins.poles import SortedPoles, sorted_poles
from actuator_lti.step_delayed import delayed_response

_ALIVE = 14.0  # time constants after which a mode is forgotten
_FINE = 0.05  # step over the reciprocal of the fastest mode that is alive
_MOST = 4_000_000
_SHOWN = 4000


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

    def __str__(self) -> str:
        return (
            f"rise 10-90 % {self.rise_time_s:.6g} s, overshoot {self.overshoot_percent:.4f} %, "
            f"settling 2 % {self.settling_time_s:.6g} s, final value {self.final_value:.6g}"
        )


def step_figures(system: Any) -> StepFigures:
    """Figures of the unit step response of a stable system.

    A continuous state space is propagated exactly (matrix exponentials) on a grid as fine as its fastest
    mode still alive, and each figure is then located inside its grid interval. A sampled system is looked at
    at its samples. A system with inner delays is stepped along its first delays, the delayed signals
    parabolas over steps of which at least 12 make the shortest one, and is then the sum over its exact poles.

    Parameters
    ----------
    system : StateSpace, TransferFunction or DelaySystem
        One input, one output; a closed loop.

    Raises
    ------
    InputError
        The system is not stable, or its final value is zero.

    Examples
    --------
    >>> import control
    >>> print(step_figures(control.tf([1], [1, 1])))
    rise 10-90 % 2.19722 s, overshoot 0.0000 %, settling 2 % 3.91202 s, final value 1
    """
    if hasattr(system, "delays_s"):
        if system.delays_s.size:
            return _figures(*delayed_response(system), None)
        system = system.to_state_space()
    loop = rational_loop(system)
    poles = sorted_poles(loop.A, loop.in_z)
    final = _final_value(loop, poles)
    if loop.period_s is not None:
        return _sampled(loop, poles, final, loop.period_s)
    segments = _segments(poles.values)
    time, states = _propagated(loop, segments)
    response = states[: loop.order].T @ loop.c + loop.d

    def between(k: int, t: float) -> float:
        x = expm(_augmented(loop) * (t - time[k])) @ states[:, k]
        return float(x[: loop.order] @ loop.c + loop.d)

    return _figures(time, response, final, between, None)


def _final_value(loop: RationalLoop, poles: SortedPoles) -> float:
    at_dc = sum(pole.multiplicity for pole in poles.border if pole.x == 0.0)
    if poles.unstable or poles.border_count > at_dc or at_dc > 1:
        raise InputError("the system is not stable: it has no step figures")
    if not at_dc:
        final = float(loop.response(np.zeros(1))[0].real)
    else:  # allowed only where neither driven nor seen
        away = np.abs(poles.values - 1.0) if loop.in_z else np.abs(poles.values)
        r = 1e-6 * float(np.sort(away)[1]) if away.size > 1 else 1e-6
        L = loop.response(np.array([r, 0.1 * r]))
        if abs(L[1]) > 2.0 * abs(L[0]):
            raise InputError("the system integrates: its step response has no final value")
        final = float(L[1].real)
    if final == 0.0 or not np.isfinite(final):
        raise InputError(
            "the final value of the step response is zero: it has no rise, overshoot or settling"
        )
    return final


def _augmented(loop: RationalLoop) -> Real:
    M = np.zeros((loop.order + 1, loop.order + 1))
    M[:-1, :-1], M[:-1, -1] = loop.A, loop.b
    return M


def _segments(poles: np.ndarray) -> list[tuple[float, int]]:
    """(step, number of steps) one after the other; a mode counts until it is forgotten."""
    alive = poles[poles.real < -1e-12 * max(float(np.abs(poles).max(initial=0.0)), 1e-300)]
    if not alive.size:
        return [(1.0, 1)]
    ends = np.unique(_ALIVE / -alive.real)
    out, start, total = [], 0.0, 0
    for end in ends:
        if end - start <= 1e-12 * end:
            continue
        fastest = float(np.abs(alive[_ALIVE / -alive.real >= end * (1.0 - 1e-12)]).max())
        steps = max(int(np.ceil((end - start) * fastest / _FINE)), 8)
        total += steps
        if total > _MOST:
            raise InputError(
                "the step response rings for more than a million periods: it is not settled in practice"
            )
        out.append(((end - start) / steps, steps))
        start = float(end)
    return out


def _propagated(loop: RationalLoop, segments: list[tuple[float, int]]) -> tuple[Real, Real]:
    M = _augmented(loop)
    state = np.zeros(loop.order + 1)
    state[-1] = 1.0
    times: list[Real] = [np.zeros(1)]
    states: list[Real] = [state[:, None]]
    start = 0.0
    for h, steps in segments:
        run = powers(expm(M * h), states[-1][:, -1], steps)
        times.append(start + h * np.arange(1, steps + 1))
        states.append(run)
        start += h * steps
    return np.concatenate(times), np.concatenate(states, axis=1)


def powers(P: Real, x: Real, steps: int) -> Real:
    """P x, P^2 x, ..., P^steps x as columns, by doubling."""
    run = (P @ x)[:, None]
    while run.shape[1] < steps:
        run = np.concatenate((run, P @ run), axis=1)
        P = P @ P
    return run[:, :steps]


def _located(time: Real, between: Callable[[int, float], float], k: int, level: float) -> float:
    """Where the response passes a level between grid points k and k + 1."""
    low, high = between(k, float(time[k])) - level, between(k, float(time[k + 1])) - level
    if low * high >= 0.0:
        return float(time[k] if abs(low) < abs(high) else time[k + 1])
    return float(brentq(lambda t: between(k, t) - level, time[k], time[k + 1], xtol=1e-300, rtol=1e-13))


def _passage(time: Real, y: Real, between: Callable[[int, float], float], level: float) -> float:
    k = int(np.argmax(y >= level))
    return float(time[0]) if k == 0 else _located(time, between, k - 1, level)


def _figures(
    time: Real, response: Real, final: float, between: Callable[[int, float], float], period_s: float | None
) -> StepFigures:
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
    return StepFigures(rise, max(100.0 * (peak - 1.0), 0.0), settling, final, peak * final, at, period_s,
                       time[keep], response[keep])  # fmt: skip


def _peak(time: Real, y: Real, between: Callable[[int, float], float]) -> tuple[float, float]:
    k = int(y.argmax())
    if y[k] <= 1.0 + 1e-9:
        return 1.0, float("inf")
    if k in (0, y.size - 1):
        return float(y[k]), float(time[k])
    from scipy.optimize import minimize_scalar

    def below(t: float) -> float:
        return -between(k - 1 if t < time[k] else k, t)

    found = minimize_scalar(below, bounds=(time[k - 1], time[k + 1]), method="bounded",
                            options={"xatol": 1e-10 * float(time[k + 1])})  # fmt: skip
    return (-float(found.fun), float(found.x)) if -found.fun > y[k] else (float(y[k]), float(time[k]))


def _shown(time: Real, settling: float) -> np.ndarray:
    last = int(np.searchsorted(time, 2.0 * settling)) if settling > 0.0 else time.size
    count = max(min(last + 1, time.size), 2)
    return np.unique(np.linspace(0, count - 1, min(count, _SHOWN)).astype(int))


def _sampled(loop: RationalLoop, poles: SortedPoles, final: float, period_s: float) -> StepFigures:
    size = np.abs(poles.values)
    size = size[(size > 1e-3) & (size < 1.0 - 1e-12)]
    steps = int(min(max(_ALIVE / -np.log(size.max()) if size.size else 1.0, loop.order + 2.0), float(_MOST)))
    M = np.eye(loop.order + 1)
    M[:-1, :-1], M[:-1, -1] = loop.A, loop.b
    start = np.zeros(loop.order + 1)
    start[-1] = 1.0
    states = np.concatenate((start[:, None], powers(M, start, steps)), axis=1)
    response = states[: loop.order].T @ loop.c + loop.d
    time = period_s * np.arange(response.size)
    y = response / final
    rise = float(time[int(np.argmax(y >= 0.9))] - time[int(np.argmax(y >= 0.1))])
    outside = np.flatnonzero(np.abs(y - 1.0) > 0.02)
    settling = float(time[min(int(outside[-1]) + 1, y.size - 1)]) if outside.size else 0.0
    k = int(y.argmax())
    over = bool(y[k] > 1.0 + 1e-9)
    keep = _shown(time, settling)
    return StepFigures(
        rise, 100.0 * float(y[k] - 1.0) if over else 0.0, settling, final,
        float(response[k]) if over else final, float(time[k]) if over else float("inf"), period_s,
        time[keep], response[keep],
    )  # fmt: skip
