"""A drive in plain Python: the controller of the equations, the plant by Runge-Kutta, tick by tick.

It shares nothing with the simulator: what it shows of a finding is independent of it.
"""

from dataclasses import dataclass
from math import ceil, sin, sqrt, tanh

import numpy as np

from actuator_lti.design.model import Design
from tests.nonlinear.controller_reference import Controller

PER_RADIAN = 8  # parts of a tick for a radian of the coupling's oscillation
State = tuple[float, ...]  # i, w, th; behind a coupling also W, phi


@dataclass
class DrySide:
    """Friction of one side: what slides feels it against its motion, what stands holds up to breakaway."""

    forward: float
    backward: float
    ratio: float
    sense: float = 0.0

    def look(self, speed: float, torque: float, more: float = 0.0) -> None:
        """The sense of the motion, 0 where the side stands; ``more`` is friction by load."""
        if speed != 0.0:
            self.sense = 1.0 if speed > 0.0 else -1.0
        else:
            loose = ((self.forward if torque > 0.0 else self.backward) + more) * self.ratio
            self.sense = 0.0 if abs(torque) <= loose else (1.0 if torque > 0.0 else -1.0)

    def pull(self, more: float = 0.0) -> float:
        """Torque on what slides."""
        return -self.forward - more if self.sense > 0.0 else self.backward + more


class PlainPlant:
    """J dw/dt = kM i - F(w) - b w - T/N_c, J_l dW/dt = T - F_l - b_l W + M/N_r, L di/dt = u - R i - kE w.

    T is the coupling's torque (spring, damper, play), which a self-locking stage keeps from the motor;
    without one the load turns with the motor.  F is Tc tanh(w/w_s), or (Tc + CM |load|) sign(w): then a part
    of a tick that would reverse the speed ends at rest, where the side stays until the torque on it exceeds
    breakaway.
    """

    def __init__(self, design: Design) -> None:
        self.design, friction, load = design, design.friction, design.load
        self.motor = design.effective_motor
        self.smooth = friction.law == "tanh"
        assert self.motor.resistance_ohm is not None
        assert not friction.points
        Tc = friction.dry_torque_Nm
        back = Tc if friction.dry_torque_reverse_Nm is None else friction.dry_torque_reverse_Nm
        self.own = DrySide(Tc, back, friction.breakaway_ratio)
        behind, coupling = load.friction, design.coupling
        dry = 0.0 if behind is None else behind.dry_torque_Nm
        self.load_side = DrySide(dry, dry, 1.0 if behind is None else behind.breakaway_ratio)
        self.elastic = coupling is not None
        self.dry, self.felt = Tc > 0.0 or friction.load_coefficient > 0.0, load.path == "back-drivable"
        self.J = design.motor_side_inertia_kgm2 if self.elastic else design.inertia_kgm2
        self.J_l = design.load_side_inertia_kgm2
        self.rest: State = (0.0,) * (5 if self.elastic else 3)
        self.fastest = 0.0
        if coupling is not None:
            per_inertia = 1.0 / self.J_l + 1.0 / (self.J * design.ratio_to_coupling**2)
            k, c = coupling.stiffness_Nm_rad, coupling.damping_Nms_rad
            self.fastest = max(sqrt(k * per_inertia), c * per_inertia)

    def moment(self, angle: float) -> float:
        """On the output, N m."""
        load, gravity = self.design.load, self.design.load.gravity
        pull = gravity.peak_Nm * sin(angle + gravity.offset_rad) if gravity is not None else 0.0
        return load.moment_slope_Nm_rad * angle + pull

    def spring(self, x: State) -> float:
        """Torque of the coupling at its own shaft."""
        coupling, N_c = self.design.coupling, self.design.ratio_to_coupling
        twist, rate, b = x[2] / N_c - x[4], x[1] / N_c - x[3], 0.5 * coupling.play_rad
        if abs(twist) < b:
            return 0.0
        edge = b if twist > 0.0 else -b
        torque = coupling.stiffness_Nm_rad * (twist - edge) + coupling.damping_Nms_rad * rate
        return torque if b == 0.0 or torque * twist > 0.0 else 0.0

    def torques(self, x: State) -> tuple[float, float]:
        """On the motor and on the load, without dry friction."""
        friction, N = self.design.friction, self.design.total_ratio
        kM = self.motor.torque_constant_Nm_A or 0.0
        on_motor = kM * x[0] - friction.viscous(1 if x[1] >= 0.0 else -1) * x[1] - friction.offset_torque_Nm
        if not self.elastic:
            return on_motor + (self.outside(x) / N if self.felt else 0.0), 0.0
        T, N_r, behind = self.spring(x), self.design.ratio_behind_coupling, self.design.load.friction
        on_load = T + self.outside(x) / N_r
        if behind is not None:
            on_load -= behind.viscous_Nms_rad * x[3] + behind.offset_torque_Nm
        return on_motor - (T / self.design.ratio_to_coupling if self.felt else 0.0), on_load

    def outside(self, x: State) -> float:
        """All that acts on the output, N m."""
        N, N_r = self.design.total_ratio, self.design.ratio_behind_coupling
        angle, speed = (x[4] / N_r, x[3] / N_r) if self.elastic else (x[2] / N, x[1] / N)
        return self.moment(angle) - self.design.load.moment_damping_Nms_rad * speed

    def by_load(self, x: State) -> float:
        """Friction of the motor's side that the load presses out, N m."""
        share = self.design.friction.load_coefficient
        if share == 0.0:
            return 0.0
        if not self.elastic:
            return share * abs(self.outside(x))
        return share * self.design.ratio_behind_coupling * abs(self.spring(x))

    def rate(self, x: State, u: float) -> State:
        motor = self.motor
        on_motor, on_load = self.torques(x)
        if self.smooth:
            on_motor -= self.own.forward * tanh(x[1] / self.design.friction.smoothing_speed_rad_s)
        else:
            on_motor = on_motor + self.own.pull(self.by_load(x)) if self.own.sense else 0.0
        back_emf = (motor.back_emf_constant_Vs_rad or 0.0) * x[1]
        current = (u - (motor.resistance_ohm or 0.0) * x[0] - back_emf) / (motor.inductance_H or 1.0)
        first = (current, on_motor / self.J, x[1])
        if not self.elastic:
            return first
        on_load = on_load + self.load_side.pull() if self.load_side.sense else 0.0
        return (*first, on_load / self.J_l, x[3])

    def run(self, x: State, u: float, span_s: float, part_s: float) -> State:
        """The state after a time under a constant voltage."""
        n = max(ceil(span_s / part_s), ceil(PER_RADIAN * self.fastest * span_s), 1)
        h = span_s / n
        for _ in range(n):
            on_motor, on_load = self.torques(x)
            self.own.look(x[1], on_motor, self.by_load(x))
            if self.elastic:
                self.load_side.look(x[3], on_load)
            k1 = self.rate(x, u)
            k2 = self.rate(_moved(x, 0.5 * h, k1), u)
            k3 = self.rate(_moved(x, 0.5 * h, k2), u)
            k4 = self.rate(_moved(x, h, k3), u)
            slopes = zip(k1, k2, k3, k4, strict=True)
            x = _moved(x, h / 6.0, tuple(p + 2.0 * q + 2.0 * r + s for p, q, r, s in slopes))
            if not self.smooth and self.dry and x[1] * self.own.sense < 0.0:
                x = (x[0], 0.0, *x[2:])
            if self.elastic and self.load_side.forward and x[3] * self.load_side.sense < 0.0:
                x = (*x[:3], 0.0, x[4])
        return x


def _moved(x: State, h: float, slopes: State) -> State:
    return tuple(a + h * k for a, k in zip(x, slopes, strict=True))


def output_of_step(design: Design, size_rad: float, ticks: int, parts: int = 4) -> np.ndarray:
    """The output angle (rad) at every tick after a step of the command from rest.

    u is the controller's voltage, one computing delay late; ``parts`` of a tick at least are integrated.
    """
    plant = PlainPlant(design)
    Ts, delay = design.controller.period_s, design.controller.computing_delay_s
    whole = int(delay / Ts + 1e-9)
    part = delay - whole * Ts
    control = Controller(design)
    line, x, out = [0.0] * (whole + 1), plant.rest, np.empty(ticks)
    for k in range(ticks):
        out[k] = x[4] / design.ratio_behind_coupling if plant.elastic else x[2] / design.total_ratio
        line = [control.tick(size_rad, *x[:3], out[k]), *line][: whole + 2]
        if part > 1e-9 * Ts:
            x = plant.run(x, line[whole + 1], part, Ts / parts)
        x = plant.run(x, line[whole], Ts - part, Ts / parts)
    return out
