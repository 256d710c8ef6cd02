"""The same cascade built of python-control's nonlinear systems, for the speed comparison.

Continuous controllers (RK45 knows no ticks), the tanh law, the same limits and conditional integration.
"""

from __future__ import annotations

import time
from math import pi, radians

import control
import numpy as np

from actuator_lti.design.model import Design


def build(design: Design, load_Nm: float) -> control.InterconnectedSystem:
    """Position P, velocity PI and current PI around the drive, from ``ref`` (output, rad) to ``th``."""
    m, limits, place = design.motor, design.limits, design.controller.position_loop
    velocity, current = design.controller.velocity, design.controller.current
    assert velocity is not None  # the baseline's cascade
    assert velocity.integral_time_s is not None
    assert current is not None
    assert current.integral_time_s is not None
    Tc, Cv, ws = (
        design.friction.dry_Nm(load_Nm),
        design.friction.viscous(),
        design.friction.smoothing_speed_rad_s,
    )
    J, N = design.inertia_kgm2, design.total_ratio

    def drive(t: float, x: np.ndarray, u: np.ndarray, params: dict) -> np.ndarray:
        i, w, _ = x
        di = (u[0] - m.resistance_ohm * i - m.back_emf_constant_Vs_rad * w) / m.inductance_H
        return np.array([di, (m.torque_constant_Nm_A * i - Tc * np.tanh(w / ws) - Cv * w) / J, w])

    def pi_controller(
        name: str, gain: float, integral_time_s: float, limit: float
    ) -> control.NonlinearIOSystem:
        def update(t: float, x: np.ndarray, u: np.ndarray, params: dict) -> np.ndarray:
            e = u[0] - u[1]
            v = gain * e + x[0]
            return np.array([gain * e / integral_time_s if abs(v) < limit or v * e < 0.0 else 0.0])

        def output(t: float, x: np.ndarray, u: np.ndarray, params: dict) -> np.ndarray:
            return np.clip(gain * (u[0] - u[1]) + x, -limit, limit)

        return control.nlsys(update, output, inputs=["r", "y"], outputs=["v"], states=1, name=name)

    def position(t: float, x: np.ndarray, u: np.ndarray, params: dict) -> np.ndarray:
        return np.clip([place.gain * (N * u[0] - u[1])], -limits.speed_rad_s, limits.speed_rad_s)

    systems = [
        control.nlsys(
            drive, lambda t, x, u, p: x, inputs=["u"], outputs=["i", "w", "th"], states=3, name="d"
        ),
        control.nlsys(None, position, inputs=["ref", "th"], outputs=["w_ref"], name="p"),
        pi_controller("v", velocity.gain, velocity.integral_time_s, limits.peak_current_A),
        pi_controller("c", current.gain_V_A, current.integral_time_s, limits.voltage_V),
    ]
    wires = [
        ["d.u", "c.v"],
        ["p.th", "d.th"],
        ["v.r", "p.w_ref"],
        ["v.y", "d.w"],
        ["c.r", "v.v"],
        ["c.y", "d.i"],
    ]
    return control.interconnect(
        systems, wires, inplist=["p.ref"], outlist=["d.th"], inputs=["ref"], outputs=["th"]
    )


def seconds_per_second(design: Design, load_Nm: float, span_s: float = 0.02) -> float:
    """Seconds of work for a simulated second of the 5 deg, 1 Hz sine."""
    system = build(design, load_Nm)
    t = np.arange(0.0, span_s, design.controller.period_s)
    ref = radians(5.0) * np.sin(2.0 * pi * t)
    start = time.perf_counter()
    control.input_output_response(system, t, ref, solve_ivp_method="RK45", solve_ivp_kwargs={"rtol": 1e-6})
    return (time.perf_counter() - start) / span_s
