"""Sections 2, 6 and 7 of model.md tick by tick in plain Python, without limits: the other implementation.

It shares nothing with the package but the design: the controller is that of the running drive's own tests,
written from the equations, the plant the exponential of each piece of a tick.
"""

from dataclasses import replace
from math import inf

import numpy as np
from scipy.linalg import expm, matrix_balance

from actuator_lti.design.model import Design, Limits
from tests.nonlinear.controller_reference import Controller


def plant(design: Design, contact: float) -> tuple[np.ndarray, np.ndarray]:
    """A and B (u, torque at the motor, moment at the output) over i, w, th, W, phi; contact is sgn(w T_s)."""
    motor, friction, load, coupling = design.motor, design.friction, design.load, design.coupling
    A, B = np.zeros((5, 5)), np.zeros((5, 3))
    back = load.path == "back-drivable"
    N_c, N_r, N = design.ratio_to_coupling, design.ratio_behind_coupling, design.total_ratio
    J = design.inertia_kgm2 if coupling is None else design.motor_side_inertia_kgm2
    A[1, 1], A[2, 1], B[1, 1] = -friction.viscous_Nms_rad / J, 1.0, 1 / J
    if motor.source_gain_Nm_V is None:
        R, L = motor.resistance_ohm, motor.inductance_H
        A[0, 0], A[0, 1], B[0, 0] = -R / L, -motor.back_emf_constant_Vs_rad / L, 1 / L
        A[1, 0] = motor.torque_constant_Nm_A / J
    else:
        B[1, 0] = motor.source_gain_Nm_V / J
    if coupling is None:
        A[4, 1] = 1 / N_c
        B[1, 2] = 1 / (N * J) if back else 0.0
        return A, B
    k, c, J_l = coupling.stiffness_Nm_rad, coupling.damping_Nms_rad, design.load_side_inertia_kgm2
    T_s = np.array([0.0, c / N_c, k / N_c, -c, -k])
    felt = (1 / N_c if back else 0.0) + contact * friction.load_coefficient * N_r
    A[1] -= felt * T_s / J
    A[3] += T_s / J_l
    A[3, 3] -= (load.friction.viscous_Nms_rad if load.friction else 0.0) / J_l
    A[4, 3], B[3, 2] = 1.0, 1 / (N_r * J_l)
    return A, B


class Unlimited(Controller):
    """Without limits."""

    def __init__(self, design: Design) -> None:
        super().__init__(replace(design, limits=Limits(voltage_V=inf)))

    def limit_outer(self, v: float) -> float:
        return v

    def slope(self, target: float, every: int) -> float:
        return target


def run(design, command, torque_Nm=0.0, moment_Nm=0.0, contact=1.0, initial=(0.0, 0.0, 0.0)):
    """Run the drive while it slips forward, the command at the motor where the outermost stage is the speed.

    Signals i, w, th, phi and u at every tick.  ``initial`` is (i, w, th).
    """
    control, N, load = design.controller, design.total_ratio, design.load
    Ts, d = control.period_s, control.computing_delay_s
    A, B = plant(design, contact)
    q = int(np.floor(d / Ts + 1e-9))
    f = d / Ts - q
    f = f if f > 1e-9 else 0.0  # the rule of `split_delay`: an unstable drive would show the difference
    pieces = []
    for h in (f * Ts, (1 - f) * Ts):
        whole = np.block([[A * h, B * h], [np.zeros((3, 8))]])
        whole, (size, _) = matrix_balance(whole, permute=False, separate=True)
        E = size[:, None] * expm(whole) / size  # without the balance a stiff one loses seven digits
        pieces.append((E[:5, :5], E[:5, 5:]))
    plain = Unlimited(design)
    plain.speed.angles = [initial[2]] * len(plain.speed.angles)
    behind = control.velocity is not None and control.velocity.sensor == "output" and design.coupling
    scale = N if control.outermost == "velocity" else 1.0
    x, past = np.array([*initial, 0.0, initial[2] / design.ratio_to_coupling]), [0.0] * (q + 2)
    states, u = np.empty((len(command), 5)), np.empty(len(command))
    for k, value in enumerate(command):
        states[k] = i, w, th, W, phi = x
        angle = phi / design.ratio_behind_coupling
        seen = design.ratio_to_coupling * W if behind else w
        past = [plain.tick(value / scale, i, seen, th, angle), *past[:-1]]
        u[k], turning = past[0], W / design.ratio_behind_coupling if design.coupling else w / N
        held = moment_Nm + load.moment_slope_Nm_rad * angle - load.moment_damping_Nms_rad * turning
        for (Phi, Gamma), j in zip(pieces, (q + 1, q), strict=True):
            x = Phi @ x + Gamma @ np.array([past[j], torque_Nm, held])
    return dict(zip(("i", "w", "th", "W", "phi"), states.T, strict=True)) | {"u": u}
