"""Sections 6 and 7 of model.md, tick by tick in plain Python, without limits: the other implementation.

Written from the page, sharing nothing with the package but the design: stored angles, filters as difference
equations, the tracking loop with its own angle, the plant with the angle behind the spring as a state.
"""

from __future__ import annotations

from math import tan

import numpy as np
from scipy.linalg import expm

from actuator_lti.design.model import Design, Filter


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


def coefficients(item: Filter, T: float) -> tuple[list[float], list[float]]:
    """b and a by substituting s = w0/tan(w0 T/2) (z - 1)/(z + 1)."""
    if item.kind == "biquad":
        return list(item.b), [1.0, *item.a]
    w0 = item.frequency_rad_s
    if item.kind == "lowpass":
        top, bottom = [w0], [1.0, w0]
        if item.order == 2:
            top, bottom = [w0**2], [1.0, 2 * item.damping * w0, w0**2]
    elif item.kind == "notch":
        top, bottom = [1.0, item.depth * item.width_rad_s, w0**2], [1.0, item.width_rad_s, w0**2]
    elif item.kind == "skewed-notch":
        w0, wz, wp = (item.zero_rad_s * item.pole_rad_s) ** 0.5, item.zero_rad_s, item.pole_rad_s
        top = [1 / wz**2, item.depth * item.width_rad_s / wz**2, 1.0]
        bottom = [1 / wp**2, item.width_rad_s / wp**2, 1.0]
    else:
        w0 = (item.zero_rad_s * item.pole_rad_s) ** 0.5
        top, bottom = [1 / item.zero_rad_s, 1.0], [1 / item.pole_rad_s, 1.0]
    n, K = len(bottom) - 1, w0 / tan(w0 * T / 2)
    b, a = (
        sum(
            p[len(p) - 1 - j] * K**j * np.poly1d([1.0, -1.0]) ** j * np.poly1d([1.0, 1.0]) ** (n - j)
            for j in range(len(p))
        )
        for p in (top, bottom)
    )
    return list(np.atleast_1d(b.coeffs)), list(np.atleast_1d(a.coeffs))


class Difference:
    """y = (sum b x - sum a y)/a0 with stored values."""

    def __init__(self, item: Filter, T: float) -> None:
        self.b, self.a = coefficients(item, T)
        self.x, self.y = [0.0] * len(self.b), [0.0] * (len(self.a) - 1)

    def __call__(self, value: float) -> float:
        self.x = [value, *self.x[:-1]]
        total = sum(b * x for b, x in zip(self.b, self.x, strict=True))
        total -= sum(a * y for a, y in zip(self.a[1:], self.y, strict=True))
        self.y = [total / self.a[0], *self.y][: len(self.y)]
        return total / self.a[0]


class Tracking:
    """p = th^ + T w^, r = th - p, th^ = p + 2 w0 T r, w^ += w0^2 T r."""

    def __init__(self, w0: float, T: float, angle: float) -> None:
        self.w0, self.T, self.angle, self.speed = w0, T, angle, 0.0

    def __call__(self, angle: float) -> float:
        p = self.angle + self.T * self.speed
        r = angle - p
        self.angle, self.speed = p + 2 * self.w0 * self.T * r, self.speed + self.w0**2 * self.T * r
        return self.speed


def run(design: Design, command: np.ndarray, moment_Nm: float, contact: float) -> dict[str, np.ndarray]:
    """Run the drive from rest; signals th, w, phi, u at every tick."""
    control, encoder, motor, N = design.controller, design.encoder, design.motor, design.total_ratio
    position, velocity, current = control.position, control.velocity, control.current
    Ts, d = control.period_s, control.computing_delay_s
    n_p, n_v = position.every if position else 1, velocity.every if velocity else 1
    outer = n_p if position else n_v if velocity else 1
    A, B = plant(design, contact)
    q = int(np.floor(d / Ts + 1e-9))
    f = d / Ts - q
    f = f if f > 1e-9 else 0.0  # the rule of `split_delay`: an unstable drive would show the difference
    pieces = []
    for h in (f * Ts, (1 - f) * Ts):
        E = expm(np.block([[A * h, B * h], [np.zeros((3, 8))]]))
        pieces.append((E[:5, :5], E[:5, 5:]))
    prefilter = None
    if design.command.filter_time_s:
        item = Filter(kind="lowpass", frequency_rad_s=1 / design.command.filter_time_s,
                      order=design.command.filter_order, damping=design.command.filter_damping)  # fmt: skip
        prefilter = Difference(item, outer * Ts)
    T_v, T_p = n_v * Ts, n_p * Ts
    on_speed = [Difference(item, T_v) for item in (velocity.filters_on("speed") if velocity else ())]
    on_torque = [Difference(item, T_v) for item in (velocity.filters_on("torque") if velocity else ())]
    tracking = Tracking(encoder.bandwidth_rad_s, T_v, 0.0) if encoder.speed == "tracking" else None
    angles = [0.0] * (encoder.difference_samples + 1)
    x, past = np.zeros(5), [0.0] * (q + 2)
    I_p = I_v = I_i = D = last_e = last_r = before_r = y = 0.0
    slow = middle = i_ff = measured = reference = 0.0
    drive = motor.source_gain_Nm_V or motor.torque_constant_Nm_A
    if motor.source_gain_Nm_V is None and current is None:
        drive /= motor.resistance_ohm
    out: dict[str, list[float]] = {name: [] for name in ("th", "w", "phi", "u")}
    for k, value in enumerate(command):
        i, w, th, W, phi = x
        angle = phi / design.ratio_behind_coupling
        if k % outer == 0:
            reference = prefilter(value) if prefilter else value
        if position and k % n_p == 0:
            r = N * reference
            e = r - (N * angle if position.sensor == "output" else th)
            if position.integral_time_s:
                I_p += position.gain * T_p / position.integral_time_s * e
            if position.derivative_time_s:
                share = T_p / (position.derivative_filter_s + T_p)
                D += share * ((e - last_e) / T_p - D)
            last_e = e
            slow = position.gain * (e + position.derivative_time_s * D) + I_p
            slow += position.feedforward * (r - last_r) / T_p
            i_ff = position.acceleration_feedforward * design.inertia_kgm2 / drive
            i_ff *= (r - 2 * last_r + before_r) / T_p**2
            before_r, last_r = last_r, r
            if not velocity:
                slow += i_ff
        if not position:
            slow = reference
        if k % n_v == 0:
            behind = velocity is not None and velocity.sensor == "output"
            seen = N * angle if behind else th
            angles = [*angles[1:], seen]
            measured = design.ratio_to_coupling * W if behind and design.coupling else w
            if encoder.speed == "difference":
                measured = (angles[-1] - angles[0]) / (encoder.difference_samples * T_v)
            elif tracking:
                measured = tracking(seen)
            y += T_v / (encoder.filter_time_s + T_v) * (measured - y)
            measured = y
            for each in on_speed:
                measured = each(measured)
            if velocity:
                e = slow - measured
                if velocity.integral_time_s:
                    I_v += velocity.gain * T_v / velocity.integral_time_s * e
                middle = velocity.gain * e + I_v + i_ff
                for each in on_torque:
                    middle = each(middle)
        u = middle if velocity else slow
        if current:
            i_ref = u
            e = i_ref - i
            if current.integral_time_s:
                I_i += current.gain_V_A * Ts / current.integral_time_s * e
            u = current.gain_V_A * e + I_i
            u += current.back_emf_feedforward * motor.back_emf_constant_Vs_rad * measured
            u += current.resistance_feedforward * motor.resistance_ohm * i_ref
        past = [u, *past[:-1]]
        for name, each in zip(("th", "w", "phi", "u"), (th, w, phi, u), strict=True):
            out[name].append(each)
        turning = W / design.ratio_behind_coupling if design.coupling else w / N
        held = moment_Nm + design.load.moment_slope_Nm_rad * angle
        held -= design.load.moment_damping_Nms_rad * turning
        for (Phi, Gamma), j in zip(pieces, (q + 1, q), strict=True):
            x = Phi @ x + Gamma @ np.array([past[j], 0.0, held])
    return {name: np.array(values) for name, values in out.items()}
