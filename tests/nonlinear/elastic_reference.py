"""The plant of model.md section 6 integrated by scipy with event functions: an independent reference.

Contact is read off the state as the page writes it; only what must be held (rest, direction of slip, contact)
is.  Each stretch is integrated by DOP853 at its tightest, with steps short against the plant's modes, and
restarts at every kink.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from actuator_lti.design.model import Design

Event = tuple[str, Callable[[float, np.ndarray], float], float]

TINY = 1e-16  # N m, so that a torque that stays exactly at its level is no event


@dataclass
class Mode:
    """Contact -1, 0, 1; direction of slip of motor and load, 0 at rest."""

    contact: int = 0
    motor: int = 0
    load: int = 0


class Reference:
    """Right-hand side and events; state (i, w, W, th, phi)."""

    def __init__(self, design: Design) -> None:
        m, f, self.design = design.motor, design.friction, design
        self.source = m.source_gain_Nm_V
        self.R, self.L = m.resistance_ohm or 1.0, m.inductance_H or 1.0
        self.kM, self.kE = m.torque_constant_Nm_A or 0.0, m.back_emf_constant_Vs_rad or 0.0
        self.Nc, self.Nr = design.ratio_to_coupling, design.ratio_behind_coupling
        c, lf = design.coupling, design.load.friction
        self.rigid, self.k, self.c, self.b = c is None, 0.0, 0.0, 0.0
        if c is not None:
            self.k, self.c, self.b = c.stiffness_Nm_rad, c.damping_Nms_rad, c.play_rad / 2
        self.Jm = design.inertia_kgm2 if self.rigid else design.motor_side_inertia_kgm2
        self.Jl = 1.0 if self.rigid else design.load_side_inertia_kgm2
        self.back = design.load.path == "back-drivable"
        self.CM, self.ratio, self.offset = f.load_coefficient * self.Nr, f.breakaway_ratio, f.offset_torque_Nm
        self.C0l, self.Cvl, self.ratio_l, self.off_l = (0.0, 0.0, 1.0, 0.0)
        if lf is not None:
            self.C0l, self.Cvl = lf.dry_torque_Nm, lf.viscous_Nms_rad
            self.ratio_l, self.off_l = lf.breakaway_ratio, lf.offset_torque_Nm
        self.friction = f
        self.u = self.M = 0.0

    def curve(self, side: int, speed: float) -> float:
        """T0 + Cv |w|, or the map with its last slope continued."""
        points = self.friction.map(side)
        if not points:
            return self.friction.dry_Nm(0.0, side) + self.friction.viscous(side) * speed
        v, T = [q.speed_rad_s for q in points], [q.torque_Nm for q in points]
        if speed > v[-1]:
            return T[-1] + (T[-1] - T[-2]) / (v[-1] - v[-2]) * (speed - v[-1])
        return float(np.interp(speed, v, T))

    def spring(self, x: np.ndarray, side: int) -> float:
        """Side T_s as the page writes it for contact."""
        delta, rate = x[3] / self.Nc - x[4], x[1] / self.Nc - x[2]
        return side * (self.stretched(delta - side * self.b) + self.c * rate)

    def stretched(self, z: float) -> float:
        """Torque of the spring alone: k z, or the data sheet's points (0, 0), (T1/K1, T1) ... and beyond."""
        c = self.design.coupling
        knots = [(0.0, 0.0, self.k)]
        for T, K in ((c.torque_1_Nm, c.stiffness_2_Nm_rad), (c.torque_2_Nm, c.stiffness_3_Nm_rad)):
            if T is not None:
                knots.append((knots[-1][0] + (T - knots[-1][1]) / knots[-1][2], T, K))
        z0, T0, K0 = next(knot for knot in reversed(knots) if abs(z) >= knot[0])
        return float(np.copysign(T0 + K0 * (abs(z) - z0), z))

    def torque(self, x: np.ndarray, mode: Mode) -> float:
        return mode.contact * self.spring(x, mode.contact) if mode.contact else 0.0

    def drive(self, x: np.ndarray, Ts: float) -> float:
        """All torque on the motor but friction."""
        motor = self.source * self.u if self.source is not None else self.kM * x[0]
        back = (self.M / self.Nc / self.Nr if self.rigid else -Ts / self.Nc) if self.back else 0.0
        return motor - self.offset + back

    def extra_dry(self, Ts: float) -> float:
        return self.CM * abs(self.M if self.rigid else Ts)

    def level(self, x: np.ndarray, mode: Mode, side: int) -> float:
        return self.ratio * (self.curve(side, 0.0) + self.extra_dry(self.torque(x, mode)))

    def load_drive(self, x: np.ndarray, mode: Mode) -> float:
        return self.torque(x, mode) + self.M / self.Nr - self.off_l

    def rate(self, mode: Mode) -> Callable[[float, np.ndarray], list[float]]:
        def f(_: float, x: np.ndarray) -> list[float]:
            Ts = self.torque(x, mode)
            di = 0.0 if self.source is not None else (self.u - self.R * x[0] - self.kE * x[1]) / self.L
            dw = dW = 0.0
            if mode.motor:
                dry = self.curve(mode.motor, mode.motor * x[1]) + self.extra_dry(Ts)
                dw = (self.drive(x, Ts) - mode.motor * dry) / self.Jm
            if mode.load and not self.rigid:
                dW = (self.load_drive(x, mode) - mode.load * self.C0l - self.Cvl * x[2]) / self.Jl
            return [di, dw, dW, x[1], x[2] if not self.rigid else x[1] / self.Nc]

        return f

    def events(self, mode: Mode) -> list[Event]:
        result: list[Event] = []
        if not self.rigid:
            result += self.contact_events(mode)

        def motor_leaves(x: np.ndarray, k: int) -> float:
            return k * self.drive(x, self.torque(x, mode)) - self.level(x, mode, k) - TINY

        def load_leaves(x: np.ndarray, k: int) -> float:
            return k * self.load_drive(x, mode) - self.ratio_l * self.C0l - TINY

        if mode.motor:
            result.append(("land", lambda _, x: x[1], -mode.motor))
        else:
            result += [(f"motor{k}", lambda _, x, k=k: motor_leaves(x, k), 1.0) for k in (1, -1)]
        if mode.load and self.C0l:
            result.append(("load lands", lambda _, x: x[2], -mode.load))
        elif not mode.load:
            result += [(f"load{k}", lambda _, x, k=k: load_leaves(x, k), 1.0) for k in (1, -1)]
        return result

    def contact_events(self, mode: Mode) -> list[Event]:
        if self.b == 0.0:  # the kink of |T_s| is left to the integrator's step control
            return []
        if mode.contact:
            return [("part", lambda _, x: self.spring(x, mode.contact), -1.0)]
        return [(f"meet{side}", lambda _, x, s=side: self.entry(x, s), 1.0) for side in (1, -1)]

    def entry(self, x: np.ndarray, side: int) -> float:
        """Positive where both delta > b and the expression is positive."""
        beyond = side * (x[3] / self.Nc - x[4]) - self.b
        return min(self.k * beyond, self.spring(x, side))

    def step(self) -> float:
        """A step short against every mode; of a rigid drive the integrator's own."""
        if self.rigid and not self.friction.points:
            return np.inf
        fast = [self.R / self.L if self.source is None else 0.0, np.sqrt(self.k / self.Jl)]
        fast += [np.sqrt(self.k / self.Jm) / self.Nc, self.c / self.Jl, self.c / self.Jm / self.Nc**2]
        fast += [np.sqrt(self.kE * self.kM / self.L / self.Jm)]
        return 0.05 / max(*fast, 1e-3)


def initial_mode(ref: Reference, x: np.ndarray) -> Mode:
    mode = Mode(0, int(np.sign(x[1])), int(np.sign(x[2])))
    if ref.rigid:
        return mode
    if ref.b == 0.0:
        mode.contact = 1
    else:
        mode.contact = next((s for s in (1, -1) if ref.entry(x, s) > 0), 0)
    if not ref.C0l:
        mode.load = 1
    return mode


def settle(ref: Reference, x: np.ndarray, mode: Mode) -> None:
    """Leave a rest that does not hold under the present inputs: motor, then load."""
    if not mode.motor:
        drive = ref.drive(x, ref.torque(x, mode))
        for side in (1, -1):
            if side * drive > ref.level(x, mode, side) * (1 + 1e-13):
                mode.motor = side
    if not mode.load and not ref.rigid:
        for side in (1, -1):
            if side * ref.load_drive(x, mode) > ref.ratio_l * ref.C0l * (1 + 1e-13):
                mode.load = side


def happen(ref: Reference, x: np.ndarray, mode: Mode, name: str) -> None:
    if name.startswith("meet"):
        mode.contact = int(name[4:])
    elif name == "part":
        mode.contact = 0
    elif name == "land":
        was, x[1], mode.motor = mode.motor, 0.0, 0
        drive = ref.drive(x, ref.torque(x, mode))
        if -was * drive > ref.level(x, mode, -was):
            mode.motor = -was
    elif name.startswith("motor"):
        mode.motor = int(name[5:])
    elif name == "load lands":
        was, x[2], mode.load = mode.load, 0.0, 0
        if -was * ref.load_drive(x, mode) > ref.ratio_l * ref.C0l:
            mode.load = -was
    elif name.startswith("load"):
        mode.load = int(name[4:])


def advance(ref: Reference, x: np.ndarray, mode: Mode, span: float) -> np.ndarray:
    """Integrate over a stretch of held inputs with all its events."""
    t = 0.0
    settle(ref, x, mode)
    while t < span:
        # a side that leaves rest is not asked for its landing over the first instant
        leaving = (mode.motor and x[1] == 0.0) or (mode.load and ref.C0l > 0.0 and x[2] == 0.0)
        named = [event for event in ref.events(mode) if not (leaving and "land" in event[0])]
        end = min(span, t + 1e-6 * span) if leaving else span
        functions = []
        for _, function, direction in named:
            wrapped = lambda s, y, f=function: f(s, y)  # noqa: E731
            wrapped.terminal, wrapped.direction = True, direction
            functions.append(wrapped)
        out = solve_ivp(
            ref.rate(mode), (t, end), x, method="DOP853", rtol=3e-14, atol=1e-16,
            events=functions, max_step=ref.step(),
        )  # fmt: skip
        t, x = out.t[-1], out.y[:, -1].copy()
        if out.status == 1:  # all events of one instant, in their order: contact, motor, load
            for (name, _, _), times in zip(named, out.t_events, strict=True):
                if times.size:
                    happen(ref, x, mode, name)
            settle(ref, x, mode)
    return x


def reference(
    design: Design, voltages: np.ndarray, moments: np.ndarray | float = 0.0,
    start: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0), fraction_s: float = 0.0,
) -> np.ndarray:  # fmt: skip
    """States (i, w, W, th, phi) at the ticks, under prescribed voltages and moments."""
    ref, x = Reference(design), np.array(start, float)
    mode, Ts = initial_mode(ref, x), design.controller.period_s
    moment = np.broadcast_to(moments, voltages.shape)
    out, held = [x.copy()], 0.0
    for k, u in enumerate(voltages):
        ref.M = float(moment[k])
        for level, span in ((held, fraction_s), (u, Ts - fraction_s)):
            ref.u = float(level)
            if span > 0.0:
                x = advance(ref, x, mode, span)
        out.append(x.copy())
        held = u
    return np.array(out)
