"""A rigid drive in plain Python: the controller of the equations, the plant by Runge-Kutta, tick by tick.

It shares nothing with the simulator: what it shows of a finding is independent of it.
"""

from collections.abc import Callable
from math import tanh

import numpy as np

from actuator_lti.design.model import Design
from tests.nonlinear.controller_reference import Controller

State = tuple[float, float, float]  # i, w, th
Rate = Callable[[State, float], State]


def plant(design: Design) -> Rate:
    """L di/dt = u - R i - kE w, J dw/dt = kM i - Tc tanh(w/w_s) - Cv w - Toff: nothing drives back."""
    motor, friction, J, load = design.effective_motor, design.friction, design.inertia_kgm2, design.load
    assert friction.law == "tanh" or friction.dry_torque_Nm == 0.0
    assert friction.dry_torque_reverse_Nm is None
    assert not friction.points
    assert design.coupling is load.gravity is None
    assert load.path == "self-locking"
    assert load.moment_slope_Nm_rad == 0.0
    R, L = motor.resistance_ohm or 0.0, motor.inductance_H or 1.0
    kM, kE = motor.torque_constant_Nm_A or 0.0, motor.back_emf_constant_Vs_rad or 0.0
    Tc, w_s, offset = friction.dry_torque_Nm, friction.smoothing_speed_rad_s, friction.offset_torque_Nm

    def rate(x: State, u: float) -> State:
        i, w, _ = x
        lost = Tc * tanh(w / w_s) + friction.viscous(1 if w >= 0.0 else -1) * w + offset
        return (u - R * i - kE * w) / L, (kM * i - lost) / J, w

    return rate


def moved(x: State, h: float, slopes: State) -> State:
    return x[0] + h * slopes[0], x[1] + h * slopes[1], x[2] + h * slopes[2]


def run(rate: Rate, x: State, u: float, h: float) -> State:
    """The state after a time under a constant voltage."""
    k1 = rate(x, u)
    k2 = rate(moved(x, 0.5 * h, k1), u)
    k3 = rate(moved(x, 0.5 * h, k2), u)
    k4 = rate(moved(x, h, k3), u)
    for weight, slopes in ((1.0, k1), (2.0, k2), (2.0, k3), (1.0, k4)):
        x = moved(x, weight * h / 6.0, slopes)
    return x


def output_of_step(design: Design, size_rad: float, ticks: int) -> np.ndarray:
    """The output angle (rad) at every tick after a step of the command from rest.

    u is the controller's voltage, one computing delay late; each part of a tick is one step of integration.
    """
    rate, control, Ts = plant(design), Controller(design), design.controller.period_s
    late = design.controller.computing_delay_s / Ts
    whole = int(late + 1e-9)
    line, x, out = [0.0] * (whole + 2), (0.0, 0.0, 0.0), np.empty(ticks)
    for k in range(ticks):
        out[k] = x[2] / design.total_ratio
        line = [control.tick(size_rad, *x, out[k]), *line[:-1]]
        for u, part in ((line[-1], late - whole), (line[-2], 1.0 - late + whole)):
            x = run(rate, x, u, part * Ts)
    return out
