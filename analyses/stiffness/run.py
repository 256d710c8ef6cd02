"""The stiffness of a design, dynamic and static: the inverse of the response from M_ext to the output."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_lti.design.model import Design, Motor
from actuator_lti.loops.stiffness import compliance, frequencies_hz, static_stiffness, stiffness_at
from analyses.stiffness.injected import check_stiffness, lost_motion, stiffness_at_rest
from analyses.stiffness.result import State, Stiffness, StiffnessCurve

STATES: tuple[State, ...] = ("powered", "shorted", "open")
CHECKED_HZ = (2.0, 10.0, 50.0)
REST_HZ = (2.0, 20.0)
REST_FRACTIONS = (0.01, 0.1, 1.0)  # of the largest moment


def stiffness(design: Design, *, simulated: bool = True) -> Stiffness:
    """Dynamic and static stiffness and lost motion of a design.

    Parameters
    ----------
    design : Design
    simulated : bool
        Put them to the simulator: a moment injected at three frequencies, and a slow one to either side.

    Raises
    ------
    InputError
        For a loop that is not stable.
    """
    held = design.controller.position is not None
    checks = check_stiffness(design, CHECKED_HZ) if simulated and held else ()
    largest = design.load.moment_max_Nm if any(np.isfinite(one.foreseen_Nm_rad) for one in checks) else 0.0
    asked = [(f, share * largest) for f in REST_HZ for share in REST_FRACTIONS]
    return Stiffness(
        design,
        stiffness_curves(design),
        lost_motion(design, seen=simulated and held),
        checks,
        stiffness_at_rest(design, asked) if largest > 0.0 else (),
        "no position loop holds the output" if simulated and not checks else "",
    )


def unpowered(design: Design, winding: State) -> Design:
    """The design without its loops: the winding ``shorted`` (u = 0) or ``open`` (i = 0)."""
    bare = replace(design, controller=replace(design.controller, position=None, velocity=None, current=None))
    if winding == "shorted" and design.motor.has_electrical_dynamics:
        return bare
    idle = Motor(rotor_inertia_kgm2=design.motor.rotor_inertia_kgm2, source_gain_Nm_V=1.0)
    return replace(bare, motor=idle, supply=None, temperature=None)


def stiffness_curves(design: Design) -> tuple[StiffnessCurve, ...]:
    """Powered and unpowered stiffness, friction sliding (its share by load as where the motor drives).

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> [f"{curve.state} {curve.static_Nm_rad:.0f}" for curve in stiffness_curves(load_design("fin"))]
    ['powered 1324', 'shorted 30', 'open 30']
    """
    curves = []
    for state in STATES:
        if state == "shorted" and not design.motor.has_electrical_dynamics:
            continue
        response = compliance(design if state == "powered" else unpowered(design, state))
        frequency = frequencies_hz(response)
        K = stiffness_at(response, frequency)
        curves.append(StiffnessCurve(state, frequency, K, static_stiffness(response)))
    return tuple(curves)
