"""The controller of model.md sections 2 and 7 in plain Python, written from the equations alone."""

from collections import deque
from dataclasses import dataclass
from math import inf, log, sqrt, tan

import numpy as np
from scipy import signal

from actuator_lti.design.model import CurrentLoop, Design, Filter, VelocityLoop


def clamp(x: float, limit: float) -> float:
    return min(max(x, -limit), limit)


class Digital:
    """A difference equation a(z) y = b(z) x from rest at a constant value x0."""

    def __init__(self, b: np.ndarray, a: np.ndarray, x0: float) -> None:
        self.b, self.a = np.asarray(b) / a[0], np.asarray(a) / a[0]
        self.x, self.y = deque([x0] * 3, 3), deque([x0 * self.b.sum() / self.a.sum()] * 3, 3)

    def __call__(self, x: float) -> float:
        self.x.appendleft(x)
        y = sum(b * past for b, past in zip(self.b, self.x, strict=False))
        y -= sum(a * past for a, past in zip(self.a[1:], self.y, strict=False))
        self.y.appendleft(y)
        return y


def digital(item: Filter, T: float, x0: float) -> Digital:
    """A filter by scipy's bilinear transform, prewarped at its own frequency."""
    if item.kind == "biquad":
        return Digital(np.array(item.b), np.array([1.0, *item.a]), x0)
    if item.kind == "leadlag":
        w0 = sqrt(item.zero_rad_s * item.pole_rad_s)
        b, a = [1 / item.zero_rad_s, 1], [1 / item.pole_rad_s, 1]
    elif item.kind == "skewed-notch":
        wz, wp = item.zero_rad_s, item.pole_rad_s
        w0 = sqrt(wz * wp)
        b = [wp**2, wp**2 * item.depth * item.width_rad_s, (wz * wp) ** 2]
        a = [wz**2, wz**2 * item.width_rad_s, (wz * wp) ** 2]
    else:
        w0 = item.frequency_rad_s
        if item.kind == "notch":
            b, a = [1, item.depth * item.width_rad_s, w0**2], [1, item.width_rad_s, w0**2]
        elif item.order == 1:
            b, a = [w0], [1, w0]
        else:
            b, a = [w0**2], [1, 2 * item.damping * w0, w0**2]
    return Digital(*signal.bilinear(b, a, fs=w0 / tan(w0 * T / 2) / 2), x0)


@dataclass
class Regulator:
    loop: VelocityLoop | CurrentLoop
    T: float
    integral: float = 0.0

    def __call__(self, e: float, forward: float, limit: float) -> float:
        Kp = self.loop.gain if isinstance(self.loop, VelocityLoop) else self.loop.gain_V_A
        Tn = self.loop.integral_time_s
        if Tn is None:  # P: there is no integral that could wind up
            return clamp(Kp * e + forward, limit)
        new = self.integral + Kp * self.T / Tn * e
        if self.loop.anti_windup == "clamped":
            new = clamp(new, limit)
        v = Kp * e + new + forward
        out = clamp(v, limit)
        if self.loop.anti_windup == "back-calculation":
            Tt = self.loop.tracking_time_s or Tn
            self.integral = new + self.T / Tt * (out - v)
        elif self.loop.anti_windup == "clamped" or out == v or v * e < 0:
            self.integral = new
        else:
            out = clamp(Kp * e + self.integral + forward, limit)
        return out


class Profile:
    """Rate and acceleration by brute force: the braking curve is summed sample by sample."""

    def __init__(self, design: Design, T: float, x0: float) -> None:
        c = design.command
        limits = [c.rate_rad_s, c.acceleration_rad_s2, c.jerk_rad_s3]
        speed_drive = design.controller.outermost == "velocity"
        self.range, self.v_max, self.a = limits if speed_drive else (inf, *limits[:2])
        jerk = inf if speed_drive else limits[2]
        self.on, self.T = min(limits) < inf, T
        self.n = max(int(np.ceil(2 * self.a / (jerk * T) - 1e-9)), 1) if jerk < inf else 1
        self.x, self.v, self.r = x0, 0.0, x0
        self.past = deque([x0] * self.n, self.n)

    def closing(self, gap: float) -> float:
        """Largest speed from which steps of a T down to zero cover just the gap."""
        if self.a == inf:
            return gap / self.T
        d, n = abs(gap), 0
        while self.a * self.T**2 * (n + 1) * (n + 2) / 2 <= d:
            n += 1
        covered = self.a * self.T**2 * n * (n + 1) / 2
        return float(np.sign(gap)) * ((d - covered) / ((n + 1) * self.T) + n * self.a * self.T)

    def __call__(self, r: float) -> float:
        if self.on:
            r = clamp(r, self.range)
            wanted = clamp((r - self.r) / self.T + self.closing(self.r - self.x), self.v_max)
            self.v += clamp(wanted - self.v, self.a * self.T)
            self.x += self.T * self.v
            self.r, r = r, self.x
        self.past.append(r)
        return sum(self.past) / self.n


class Speed:
    def __init__(self, design: Design, T: float) -> None:
        self.encoder, self.T = design.encoder, T
        velocity = design.controller.velocity
        self.output = velocity is not None and velocity.sensor == "output"
        self.q = design.output_quantum_rad if self.output else design.angle_quantum_rad
        if self.output and self.q:
            self.q *= design.total_ratio
        self.angles = [0.0] * (self.encoder.difference_samples + 1)
        self.th = self.w = self.y = 0.0
        self.filters = [digital(f, T, 0.0) for f in velocity.filters_on("speed")] if velocity else []

    def __call__(self, w: float, th: float) -> float:
        counted = np.floor(th / self.q) * self.q if self.q else th
        if self.encoder.speed == "difference":
            self.angles = [*self.angles[1:], counted]
            w = (self.angles[-1] - self.angles[0]) / (self.encoder.difference_samples * self.T)
        elif self.encoder.speed == "tracking":
            w0, p = self.encoder.bandwidth_rad_s, self.th + self.T * self.w
            r = counted - p
            self.th, self.w = p + 2 * w0 * self.T * r, self.w + w0**2 * self.T * r
            w = self.w
        self.y += self.T / (self.encoder.filter_time_s + self.T) * (w - self.y)
        return chained(self.filters, self.y)


def chained(filters: list[Digital], x: float) -> float:
    for item in filters:
        x = item(x)
    return x


class Controller:
    """One tick at a time: measured values in, voltage out."""

    def __init__(self, design: Design) -> None:
        self.design, c = design, design.controller
        self.Ts, self.k = c.period_s, 0
        self.n_v = c.velocity.every if c.velocity else 1
        self.n_p = c.position.every if c.position else self.n_v
        self.profile = Profile(design, self.n_p * self.Ts, 0.0)
        self.filter = self.command_filter()
        self.speed = Speed(design, self.n_v * self.Ts)
        self.pi_v = Regulator(c.velocity, self.n_v * self.Ts) if c.velocity else None
        self.pi_c = Regulator(c.current, self.Ts) if c.current else None
        filters = c.velocity.filters_on("torque") if c.velocity else ()
        self.torque = [digital(f, self.n_v * self.Ts, 0.0) for f in filters]
        self.r = [0.0, 0.0]
        self.e = self.D = self.I = self.i_ff = self.w_ref = self.i_ref = self.u = self.w_meas = 0.0
        self.x, self.overloaded = 0.0, False

    def command_filter(self) -> Digital | None:
        c = self.design.command
        if c.filter_time_s == 0.0:
            return None
        w0 = 1 / c.filter_time_s
        lowpass = Filter(kind="lowpass", frequency_rad_s=w0, order=c.filter_order, damping=c.filter_damping)
        return digital(lowpass, self.n_p * self.Ts, 0.0)

    def limit_outer(self, v: float) -> float:
        limits, c = self.design.limits, self.design.controller
        if c.velocity:
            target = clamp(v, limits.speed_rad_s)
            return self.w_ref + clamp(target - self.w_ref, limits.acceleration_rad_s2 * self.n_p * self.Ts)
        if c.current:
            return self.slope(clamp(v, self.i_max), self.n_p)
        return clamp(v, limits.voltage_V)

    def slope(self, target: float, every: int) -> float:
        return self.i_ref + clamp(target - self.i_ref, self.design.limits.current_rate_A_s * every * self.Ts)

    def position(self, r: float, th: float, y: float) -> float:
        loop, N, T = self.design.controller.position, self.design.total_ratio, self.n_p * self.Ts
        if loop.sensor == "output":
            q = self.design.output_quantum_rad
            e = N * (r - (np.floor(y / q) * q if q else y))
        else:
            e = N * r - th
        self.D += T / (loop.derivative_filter_s + T) * ((e - self.e) / T - self.D)
        self.e = e
        rate, bend = (r - self.r[0]) / T, (r - 2 * self.r[0] + self.r[1]) / T**2
        self.i_ff = loop.acceleration_feedforward * self.design.inertia_kgm2 / self.torque_gain() * N * bend
        moved = r - self.r[0] if abs(r - self.r[0]) > 1e-13 * (abs(r) + abs(self.r[0])) else 0.0
        self.i_ff += loop.friction_feedforward * float(np.sign(moved))
        self.r = [r, self.r[0]]
        direct = loop.gain * (e + loop.derivative_time_s * self.D) + loop.feedforward * N * rate
        if self.pi_v is None:
            direct += self.i_ff
        new = self.I + (loop.gain * T / loop.integral_time_s * e if loop.integral_time_s else 0.0)
        out = self.limit_outer(direct + new)
        if abs(out - (direct + new)) <= 1e-12 * abs(out) or (direct + new - out) * e < 0:
            self.I = new
            return out
        return self.limit_outer(direct + self.I)

    def torque_gain(self) -> float:
        m = self.design.effective_motor
        if m.source_gain_Nm_V is not None:
            return m.source_gain_Nm_V
        return m.torque_constant_Nm_A / (1.0 if self.pi_c else m.resistance_ohm)

    def sensed(self, w: float, th: float, y: float) -> tuple[float, float]:
        return (w, self.design.total_ratio * y) if self.speed.output else (w, th)

    def overload(self, i: float) -> None:
        limits = self.design.limits
        self.i_max = limits.peak_current_A
        if limits.peak_time_s is None:
            return
        r2 = (limits.peak_current_A / limits.continuous_current_A) ** 2
        tau = limits.peak_time_s * (r2 - 1 if limits.overload == "excess" else 1 / log(r2 / (r2 - 1)))
        self.x += self.Ts / tau * ((i / limits.continuous_current_A) ** 2 - self.x)
        self.overloaded = self.x >= 1 or (self.overloaded and self.x >= limits.release)
        if self.overloaded:
            self.i_max = min(self.i_max, limits.continuous_current_A)

    def tick(self, command: float, i: float, w: float, th: float, y: float) -> float:
        c, limits, m = self.design.controller, self.design.limits, self.design.effective_motor
        self.overload(i)
        if self.k % self.n_p == 0:
            r = self.profile(command)
            r = self.filter(r) if self.filter else r
            if c.outermost == "position":
                out = self.position(r, th, y)
            else:
                out = self.limit_outer(self.design.total_ratio * r if c.velocity else r)
            if c.velocity:
                self.w_ref = out
            elif c.current:
                self.i_ref = out
            else:
                self.u = out
        if self.pi_v and self.k % self.n_v == 0:
            self.w_meas = self.speed(*self.sensed(w, th, y))
            limit = self.i_max if c.current else limits.voltage_V
            out = self.pi_v(self.w_ref - self.w_meas, self.i_ff, limit)
            out = clamp(chained(self.torque, out), limit)
            if c.current:
                self.i_ref = self.slope(out, self.n_v)
            else:
                self.u = out
        if self.pi_c:
            if self.pi_v is None and c.current.back_emf_feedforward:
                self.w_meas = self.speed(*self.sensed(w, th, y))
            wanted = clamp(self.i_ref, self.i_max)
            forward = c.current.back_emf_feedforward * m.back_emf_constant_Vs_rad * self.w_meas
            forward += c.current.resistance_feedforward * m.resistance_ohm * wanted
            self.u = self.pi_c(wanted - i, forward, limits.voltage_V)
        self.k += 1
        return self.u
