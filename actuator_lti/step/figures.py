"""Step response and its figures: rise, overshoot, settling."""

from dataclasses import dataclass, replace
from math import fsum
from typing import Any

import numpy as np

from actuator_lti.margins.given import ULP
from actuator_lti.margins.loop import RationalLoop, rational_loop
from actuator_lti.measured.response import refuse_measured
from actuator_lti.step.delayed import delayed_response
from actuator_lti.step.motion import Motion, rational_motion
from actuator_lti.step.search import Pieces, Search
from actuator_lti.systems.delay_response import plain_behind_delay
from actuator_lti.systems.precision import precision
from actuator_lti.types import Compared, Real

_SHOWN = 2000
_EPS = float(np.finfo(float).eps)
_HIDDEN = "modes on the stability boundary that the response does not show: inside, nothing damps them"
_TIE = 1e-12  # a sample this near to a level has reached it, and this near to the band is inside


@dataclass(frozen=True, eq=False)
class StepFigures(Compared):
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


@precision()
def step_figures(system: Any) -> StepFigures:
    """Figures of the unit step response of a stable system.

    A rational system is taken exactly as its doubles say, as the free motion of its certified poles, at all
    times or at its samples; one with inner delays is walked along its first delays, and is then the free
    motion of its exact poles. All figures are relative to the final value, however small that is.

    ``system``: a closed loop, one input, one output: StateSpace, TransferFunction (of
    scipy.signal too) or DelaySystem.

    Raises `InputError`: the system is not stable, its final value is zero, or it is measured data; or a
    direct feed-through with a delay that is no plain shift: one in a loop or beside another path. Raises
    `NumericalError`: the final value is lost in the rounding of the entries, or when it settles cannot be
    told.

    Examples
    --------
    >>> import control
    >>> print(step_figures(control.tf([1], [1, 1])))
    rise 10-90 % 2.19722 s, overshoot 0.0000 %, settling 2 % 3.91202 s, final value 1
    """
    refuse_measured(system)
    if hasattr(system, "delays_s"):
        if (plain := plain_behind_delay(system)) is None:
            return _figures(*delayed_response(system))
        own, late = step_figures(plain[0]), plain[1]
        if not late:
            return own
        return replace(
            own,
            settling_time_s=own.settling_time_s + late,
            peak_time_s=own.peak_time_s + late,
            time_s=np.concatenate(([0.0, late], own.time_s + late)),
            response=np.concatenate(([0.0, 0.0], own.response)),
        )
    loop = rational_loop(system)
    motion, final, hidden = rational_motion(system, loop)
    return _figures(
        motion, final, period_s=loop.period_s, notes=(*_notes(loop), *([_HIDDEN] if hidden else ()))
    )


def _figures(
    later: Motion,
    final: float,
    early: Pieces | None = None,
    period_s: float | None = None,
    notes: tuple[str, ...] = (),
) -> StepFigures:
    search = Search(_TIE if period_s else 0.0)
    if early is not None:
        search.inside(early)
    later.look(search)
    scale, settled = period_s or 1.0, max(0.0, search.last + later.sampled)
    excess = search.peak if np.isfinite(search.peak_time) else 0.0
    time, deviation = _curve(later, early, search.ninety, settled)
    return StepFigures(
        rise_time_s=(search.ninety - search.ten) * scale,
        overshoot_percent=100.0 * excess,
        settling_time_s=settled * scale,
        final_value=final,
        peak_value=(1.0 + excess) * final,
        peak_time_s=search.peak_time * scale,
        period_s=period_s,
        time_s=time * scale,
        response=(1.0 + deviation) * final,
        notes=notes,
    )


def _curve(later: Motion, early: Pieces | None, ninety: float, settled: float) -> tuple[Real, Real]:
    """Times until well after settling, close together while it rises, and the deviation there."""
    end = max(2.0 * settled or 2.0 * ninety or later.whole, later.start)
    spans = [later.curve(end, _SHOWN)]
    if later.start < (rising := min(5.0 * ninety, end)):
        spans.append(later.curve(rising, _SHOWN // 2))
    if early is not None:
        begins, lengths, series = early
        time = np.linspace(0.0, later.start, _SHOWN)
        k = np.searchsorted(begins, time, side="right") - 1
        powers = np.vander((time - begins[k]) / lengths[k], series.shape[1])
        spans.append((time, (powers * series[k]).sum(axis=1)))
    time, deviation = (np.concatenate(part) for part in zip(*spans, strict=True))
    once, first = np.unique(time, return_index=True)
    return once, deviation[first]


def _notes(loop: RationalLoop) -> tuple[str, ...]:
    """Say where the last digits of the coefficients decide about the final value."""
    if not loop.in_z or loop.coefficients is None:
        return ()
    moved = sum(float(np.abs(p).sum()) / abs(fsum(p)) for p in loop.coefficients) * ULP * _EPS
    if moved < 0.01:
        return ()
    return (
        f"rounding of the coefficients moves the final value by {100 * moved:.2g} %: "
        "the figures are those of the coefficients as given; a state space would hold the system better",
    )
