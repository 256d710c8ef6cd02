"""Step response and its figures: rise, overshoot, settling."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator_lti.margins.loop import Real, rational_loop
from actuator_lti.step.delayed import Stepped, delayed_response
from actuator_lti.step.motion import OVER, Motion
from actuator_lti.step.rational import notes, rational_motion
from actuator_lti.systems.measured_response import refuse_measured

_SHOWN = 2000


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
    system is looked at at its samples. A system with inner delays is stepped along its first delays, the
    delayed signals parabolas over steps of which at least 12 make the shortest one, and is then the free
    motion of its exact poles.

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
            return _figures((early, later), final)
        system = system.to_state_space()
    loop = rational_loop(system)
    motion, final = rational_motion(system, loop)
    return _figures((motion,), final, loop.period_s, notes(loop))


def _figures(
    parts: tuple[Stepped | Motion, ...],
    final: float,
    period_s: float | None = None,
    notes: tuple[str, ...] = (),
) -> StepFigures:
    scale = 1.0 if period_s is None else period_s
    ten, ninety = (_first(parts, level) for level in (0.1, 0.9))
    settled = next((at for part in parts[::-1] if (at := part.settled()) is not None), 0.0)
    excess, peak_time = _peak(parts)
    time, deviation = _curve(parts, ninety, settled)
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


def _first(parts: tuple[Stepped | Motion, ...], level: float) -> float:
    return next(time for part in parts if (time := part.first_at_least(level)) is not None)


def _peak(parts: tuple[Stepped | Motion, ...]) -> tuple[float, float]:
    """Excess over the final value and when; 0 and infinity where there is none."""
    best, place = OVER, np.inf
    for part in parts:
        excess, time = part.greatest(best)
        if excess > best:
            best, place = excess, time
    return (best, place) if np.isfinite(place) else (0.0, place)


def _curve(parts: tuple[Stepped | Motion, ...], ninety: float, settled: float) -> tuple[Real, Real]:
    """Times until well after settling, close together while it rises, and the deviation there."""
    *early, later = parts
    assert isinstance(later, Motion)
    end = max(2.0 * settled or 2.0 * ninety or (5.0 / later.slowest or 1.0), later.start)
    spans = [later.curve(end, _SHOWN), *(part.curve(later.start, _SHOWN) for part in early)]
    if later.start < (rising := min(5.0 * ninety, end)):
        spans.append(later.curve(rising, _SHOWN // 2))
    time, deviation = (np.concatenate(part) for part in zip(*spans, strict=True))
    once, first = np.unique(time, return_index=True)
    return once, deviation[first]
