"""Step response and its figures: rise, overshoot, settling."""

from dataclasses import dataclass
from itertools import pairwise
from operator import itemgetter
from typing import Any

import numpy as np
from scipy.optimize import brentq

from actuator_lti.margins.loop import rational_loop
from actuator_lti.step.delayed import Stepped, delayed_response
from actuator_lti.step.motion import OVER, Motion, notes, rational_motion
from actuator_lti.systems.measured_response import refuse_measured
from actuator_lti.types import Mask, Real

_SHOWN = 2000
_BAND = 0.02
_FLAT = 1e-12


@dataclass(frozen=True)
class StepFigures:
    """Figures of a unit step response.

    ``rise_time_s``: from 10 to 90 % of the final value, first passages.
    ``overshoot_percent``: largest excess over the final value, % of it; 0 where there is none.
    ``settling_time_s``: from when on the response stays within 2 % of the final value.
    ``final_value``: limit of the response.
    ``peak_value``, ``peak_time_s``: the largest value (in the direction of the final one) and when it is
    reached; where the response only approaches its final value from below, that value and infinity.
    ``period_s``: sampling period: the figures of a sampled system are times of samples.
    ``time_s``, ``response``, shape (m,): the response to look at, until well after settling.
    ``notes``: what else has to be known to read the figures.
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

    A rational system is taken exactly as its doubles say, as the free motion of its certified poles; every
    figure is found by halving all of time, so that nothing hides between two points of a grid. A sampled
    system is looked at at its samples. A system with inner delays is walked along its first delays, in pieces
    over which nothing jumps, each a polynomial, and is then the free motion of its exact poles.

    All figures are relative to the final value, however small it is beside what comes before: a resonance
    80 dB above the gain at zero frequency gives an overshoot of a million percent.

    Parameters
    ----------
    system : StateSpace, TransferFunction or DelaySystem
        One input, one output; a closed loop.

    Raises
    ------
    InputError
        The system is not stable, its final value is zero, or it is measured data.
    NumericalError
        The final value is lost in the rounding of the entries, or when it settles cannot be told.

    Examples
    --------
    >>> import control
    >>> print(step_figures(control.tf([1], [1, 1])))
    rise 10-90 % 2.19722 s, overshoot 0.0000 %, settling 2 % 3.91202 s, final value 1
    """
    refuse_measured(system)
    if hasattr(system, "delays_s"):
        if system.delays_s.size:
            early, later, final = delayed_response(system)
            return _figures([early], later, final)
        system = system.to_state_space()
    loop = rational_loop(system)
    return _figures([], *rational_motion(system, loop), loop.period_s, notes(loop))


def _figures(
    early: list[Stepped],
    later: Motion,
    final: float,
    period_s: float | None = None,
    notes: tuple[str, ...] = (),
) -> StepFigures:
    scale = 1.0 if period_s is None else period_s
    parts: list[Stepped | Motion] = [*early, later]
    ten, ninety = (
        min(_passage(part, level - 1.0 - part.tie, last=False) for part in parts) for level in (0.1, 0.9)
    )
    settled = max(0.0, *(_passage(part, _BAND + part.tie, last=True) + part.sampled for part in parts))
    excess, peak_time = OVER, np.inf
    for part in parts:
        excess, peak_time = _greatest(part, excess, peak_time)
    excess = excess if np.isfinite(peak_time) else 0.0
    time, deviation = _curve(early, later, ninety, settled)
    return StepFigures(
        rise_time_s=(ninety - ten) * scale,
        overshoot_percent=100.0 * excess,
        settling_time_s=settled * scale,
        final_value=final,
        peak_value=(1.0 + excess) * final,
        peak_time_s=peak_time * scale,
        period_s=period_s,
        time_s=time * scale,
        response=(1.0 + deviation) * final,
        notes=notes,
    )


def _passage(part: Stepped | Motion, level: float, *, last: bool) -> float:
    """The first time at which e lies above a level, or the last at which |e| does; infinite: never."""
    best, sides = (-np.inf, (level, -level)) if last else (np.inf, (level,))
    of = np.abs if last else np.asarray

    def undecided(a: Real, b: Real, left: Real, right: Real, most: Real) -> Mask:
        nonlocal best
        above = np.concatenate((a[left > level], b[right > level]))
        best = above.max(initial=best) if last else above.min(initial=best)
        return (most > level) & ((b > best) if last else (a < best))

    for a, h, series in sorted(part.spans(undecided, of), key=itemgetter(0), reverse=last):
        roots = [root for side in sides for root in _within(series, side)]
        if roots:
            return a + h * (max(roots) if last else min(roots))
    return float(best)


def _greatest(part: Stepped | Motion, best: float, place: float) -> tuple[float, float]:
    """Largest e and its time, where it is above the best so far."""

    def undecided(a: Real, b: Real, left: Real, right: Real, most: Real) -> Mask:
        nonlocal best, place
        for t, e in ((a, left), (b, right)):
            k = int(e.argmax())
            if e[k] > best or (e[k] == best and t[k] < place):
                best, place = float(e[k]), float(t[k])
        return most > best * (1.0 + _FLAT)

    for a, h, series in part.spans(undecided, np.asarray):
        for top in _within(np.polyder(series)):
            if (e := float(np.polyval(series, top))) > best:
                best, place = e, a + h * top
    return best, place


def _within(series: Real, level: float = 0.0) -> list[float]:
    """Where a power series takes a level in [0, 1], in order: its derivative's zeros part its passages."""
    f = np.poly1d(series) - level
    if not f.order:
        return []
    slope = f.deriv().coeffs
    turns = [] if abs(slope[-1]) > np.abs(slope[:-1]).sum() else _within(slope)
    edges = (0.0, *turns, 1.0)
    return [
        float(brentq(f, low, high, xtol=1e-15))
        for low, high in pairwise(edges)
        if min(f(low), f(high)) <= 0.0 <= max(f(low), f(high))
    ]


def _curve(early: list[Stepped], later: Motion, ninety: float, settled: float) -> tuple[Real, Real]:
    """Times until well after settling, close together while it rises, and the deviation there."""
    end = max(2.0 * settled or 2.0 * ninety or (5.0 / later.slowest or 1.0), later.start)
    spans = [later.curve(end, _SHOWN), *(part.curve(later.start, _SHOWN) for part in early)]
    if later.start < (rising := min(5.0 * ninety, end)):
        spans.append(later.curve(rising, _SHOWN // 2))
    time, deviation = (np.concatenate(part) for part in zip(*spans, strict=True))
    once, first = np.unique(time, return_index=True)
    return once, deviation[first]
