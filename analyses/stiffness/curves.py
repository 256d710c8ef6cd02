"""Dynamic and static stiffness: the inverse of the linear response from M_ext to the output."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design, Motor
from actuator_lti.loops import assemble_loops
from analyses.stiffness.result import State, StiffnessCurve

POINTS = 240
LOWEST_HZ, HIGHEST_HZ = 0.1, 1000.0
_SLOW_HZ = 1e-5  # where the limit at zero frequency is read


def unpowered(design: Design, winding: State) -> Design:
    """The design without its loops: the winding ``shorted`` (u = 0) or ``open`` (i = 0)."""
    bare = replace(design, controller=replace(design.controller, position=None, velocity=None, current=None))
    if winding == "shorted" and design.motor.has_electrical_dynamics:
        return bare
    idle = Motor(rotor_inertia_kgm2=design.motor.rotor_inertia_kgm2, source_gain_Nm_V=1.0)
    return replace(bare, motor=idle, supply=None, temperature=None)


def compliance(design: Design) -> Any:
    """Response from the moment at the output, held over every tick, to the output angle."""
    return assemble_loops(design).moment_to_output


def stiffness_at(response: Any, frequency_hz: npt.ArrayLike, period_s: float) -> npt.NDArray[np.complex128]:
    """K = 1 / G(exp(j w Ts)); inf where the output does not move."""
    z = np.exp(2j * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=float)) * period_s)
    G = np.atleast_1d(np.asarray(response(z), dtype=complex))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(G == 0.0, complex(np.inf), 1.0 / np.where(G == 0.0, 1.0, G))


def stiffness_curves(design: Design) -> tuple[StiffnessCurve, ...]:
    """Powered and unpowered stiffness, friction sliding (its share by load as where the motor drives).

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> [f"{curve.state} {curve.static_Nm_rad:.0f}" for curve in stiffness_curves(load_design("fin"))]
    ['powered 1324', 'shorted 30', 'open 30']
    """
    period = design.controller.period_s
    frequency = np.geomspace(LOWEST_HZ, min(HIGHEST_HZ, 0.5 / period), POINTS)
    curves = []
    for state in ("powered", "shorted", "open"):
        if state == "shorted" and not design.motor.has_electrical_dynamics:
            continue
        response = compliance(design if state == "powered" else unpowered(design, state))
        K = stiffness_at(response, frequency, period)
        curves.append(StiffnessCurve(state, frequency, K, _static(response, period)))
    return tuple(curves)


def _static(response: Any, period_s: float) -> float:
    """|K| at zero frequency, by its slope near there: 0 of a drive that runs away, inf with an integral."""
    low, high = np.abs(stiffness_at(response, [_SLOW_HZ, 10.0 * _SLOW_HZ], period_s))
    if not np.isfinite(low) or high < 0.5 * low:
        return float("inf")
    return 0.0 if high > 2.0 * low else float(low)
