"""Step response and its figures: rise, overshoot, settling."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from actuator_lti.margins.loop import Real, rational_loop
from actuator_lti.margins.measured_data import refuse_measured
from actuator_lti.step_delayed import delayed_response
from actuator_lti.step_exact import exact_response
from actuator_lti.step_response import Response, Samples
from actuator_lti.step_terms import Exponentials


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
            return _figures(*delayed_response(system), None)
        system = system.to_state_space()
    loop = rational_loop(system)
    exact = exact_response(system, loop)
    later = Exponentials(exact.terms, exact.final, exact.bits)
    response = Response(Samples(exact.first / exact.final), later, loop.in_z)
    return _figures(response, exact.final, loop.period_s, exact.notes)


def _figures(
    response: Response, final: float, period_s: float | None, notes: tuple[str, ...] = ()
) -> StepFigures:
    scale = 1.0 if period_s is None else period_s
    ten, ninety, settled = response.reached(0.1), response.reached(0.9), response.settled()
    peak, at = response.peak()
    time = response.shown(ninety, settled)
    return StepFigures(
        rise_time_s=(ninety - ten) * scale,
        overshoot_percent=max(100.0 * (peak - 1.0), 0.0),
        settling_time_s=settled * scale,
        final_value=final,
        peak_value=peak * final,
        peak_time_s=at * scale,
        period_s=period_s,
        time_s=time * scale,
        response=response.at(time) * final,
        notes=notes,
    )
