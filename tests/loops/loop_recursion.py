"""Section 2 of model.md, tick by tick in plain Python, without limits: the other implementation.

Written from the page, sharing nothing with the package but the design: the plant by the exponential of each
piece of a tick, stored angles for the difference speed, PI as written there.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from actuator_lti.design.model import Design


def _piece(A: np.ndarray, B: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    n, m = B.shape
    E = expm(np.block([[A * h, B * h], [np.zeros((m, n + m))]]))
    return E[:n, :n], E[:n, n:]


def run(
    design: Design,
    reference_rad: np.ndarray,
    torque_Nm: float = 0.0,
    initial: tuple[float, float, float] = (0.0, 0.0, 0.0),
    inject: dict[str, np.ndarray] | None = None,
) -> dict[str, np.ndarray]:
    """Run the drive while it slips forward; initial = (i, w, th). ``inject`` adds to u, i_ref or w_ref."""
    motor, control, J, N = design.motor, design.controller, design.inertia_kgm2, design.total_ratio
    Ts, d = control.period_s, control.computing_delay_s
    Cv = design.friction.viscous_Nms_rad
    source = motor.source_gain_Nm_V
    if source is None:
        R, L = motor.resistance_ohm, motor.inductance_H
        kM, kE = motor.torque_constant_Nm_A, motor.back_emf_constant_Vs_rad
        A = np.array([[-R / L, -kE / L, 0], [kM / J, -Cv / J, 0], [0, 1.0, 0]])
        B = np.array([[1 / L, 0], [0, 1 / J], [0, 0]])
    else:
        A = np.array([[0, 0, 0], [0, -Cv / J, 0], [0, 1.0, 0]])
        B = np.array([[0, 0], [source / J, 1 / J], [0, 0]])
    q = int(np.floor(d / Ts + 1e-9))
    f = max(d / Ts - q, 0.0)
    first, second = _piece(A, B, f * Ts), _piece(A, B, (1 - f) * Ts)
    x = np.array(initial, dtype=float)
    inject = inject or {}
    n_p, n_v = control.position.every, control.velocity.every if control.velocity else 1
    m, T_v, T_F = design.encoder.difference_samples, n_v * Ts, design.encoder.filter_time_s
    angles = [x[2]] * (m + 1)
    past_u = [0.0] * (q + 2)
    slow = I_v = I_i = y = last = 0.0
    middle = 0.0
    slope = 0.0
    if design.load.path == "back-drivable":
        slope = design.load.moment_slope_Nm_rad
    out: dict[str, list[float]] = {name: [] for name in ("th", "w", "i", "u", "before", "after")}

    def add(name: str, value: float, k: int) -> float:
        if name not in inject:
            return value
        out["before"].append(value)
        out["after"].append(value + inject[name][k])
        return out["after"][-1]

    for k, theta in enumerate(reference_rad):
        i, w, th = x
        if k % n_p == 0:
            command = N * theta
            target = control.position.gain * (command - th)
            target += control.position.feedforward * (command - last) / (n_p * Ts)
            last = command
            slow = add("w_ref", target, k) if control.velocity else target
        u = slow
        if control.velocity:
            if k % n_v == 0:
                angles = [*angles[1:], th]
                speed = w if design.encoder.speed == "ideal" else (angles[-1] - angles[-1 - m]) / (m * T_v)
                if T_F > 0:
                    y += T_v / (T_F + T_v) * (speed - y)
                    speed = y
                e = slow - speed
                Tn = control.velocity.integral_time_s
                if Tn is not None:
                    I_v += control.velocity.gain * T_v / Tn * e
                middle = add("i_ref", control.velocity.gain * e + I_v, k)
            u = middle
        if control.current:
            e = u - i
            if control.current.integral_time_s is not None:
                I_i += control.current.gain_V_A * Ts / control.current.integral_time_s * e
            u = control.current.gain_V_A * e + I_i
        u = add("u", u, k)
        past_u = [u, *past_u[:-1]]
        for name, value in zip(("th", "w", "i", "u"), (th, w, i, u), strict=True):
            out[name].append(value)
        load = torque_Nm + slope * (th / N) / N
        x = first[0] @ x + first[1] @ np.array([past_u[q + 1], load])
        x = second[0] @ x + second[1] @ np.array([past_u[q], load])
    return {name: np.array(values) for name, values in out.items()}
