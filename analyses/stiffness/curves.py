"""Dynamic and static stiffness: the inverse of the linear response from M_ext to the output."""

from __future__ import annotations

from dataclasses import replace

from actuator_lti.design.model import Design, Motor
from actuator_lti.loops.compliance import compliance
from actuator_lti.loops.stiffness import frequencies_hz, static_stiffness, stiffness_at
from analyses.stiffness.result import State, StiffnessCurve

STATES: tuple[State, ...] = ("powered", "shorted", "open")


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
