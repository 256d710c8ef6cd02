"""The drive under prescribed voltages, integrated by scipy with event functions: an independent reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp

from actuator_lti.design import load_design
from actuator_lti.design.model import Design, Friction, Limits, Motor
from nonlinear import Probe, State, Trajectory, commands, simulate

TIGHT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}


def bare_drive(friction: Friction, period_s: float, delay_s: float = 0.0, **motor: float) -> Design:
    """The baseline's plant with other friction, tick and motor values, voltage unlimited."""
    design = load_design("ilr33-amber")
    return replace(
        design,
        motor=replace(design.motor, **motor),
        friction=friction,
        limits=Limits(voltage_V=1e9),
        controller=replace(design.controller, period_s=period_s, computing_delay_s=delay_s),
    )


def bare_source(friction: Friction, period_s: float, gain: float, delay_s: float = 0.0) -> Design:
    """The same on an ideal torque source."""
    design = bare_drive(friction, period_s, delay_s)
    motor = Motor(rotor_inertia_kgm2=design.motor.rotor_inertia_kgm2, source_gain_Nm_V=gain)
    return replace(design, motor=motor, controller=replace(design.controller, current=None))


def drive_open(
    design: Design, voltages: np.ndarray, start: State, load_Nm: float = 0.0, **options: bool
) -> Trajectory:
    """Simulate with the voltage prescribed at every tick (the loops are cut at u)."""
    probe = Probe(point="u", gain=0.0, injection=voltages)
    duration = voltages.size * design.controller.period_s
    return simulate(design, commands.hold(), duration, load_Nm, probes=[probe], initial=start, **options)


@dataclass
class Plant:
    """Right-hand sides of slip and stick."""

    design: Design
    load_Nm: float = 0.0

    def __post_init__(self) -> None:
        d, m = self.design, self.design.motor
        self.J, self.source = d.inertia_kgm2, m.source_gain_Nm_V
        self.R, self.L = m.resistance_ohm, m.inductance_H
        self.kM, self.kE = m.torque_constant_Nm_A or 0.0, m.back_emf_constant_Vs_rad or 0.0
        self.Tb = -d.friction.offset_torque_Nm
        if d.load.path == "back-drivable":
            self.Tb += self.load_Nm / d.total_ratio
        self.Tc = {s: d.friction.dry_Nm(self.load_Nm, s) for s in (1, -1)}
        self.Cv = {s: d.friction.viscous(s) for s in (1, -1)}

    def drive(self, x: np.ndarray, u: float) -> float:
        return (self.source * u if self.source is not None else self.kM * x[0]) + self.Tb

    def slip(self, s: int, u: float) -> Callable[[float, np.ndarray], list[float]]:
        def rate(_: float, x: np.ndarray) -> list[float]:
            di = 0.0 if self.source is not None else (u - self.R * x[0] - self.kE * x[1]) / self.L
            return [di, (self.drive(x, u) - s * self.Tc[s] - self.Cv[s] * x[1]) / self.J, x[1]]

        return rate

    def stick(self, u: float) -> Callable[[float, np.ndarray], list[float]]:
        def rate(_: float, x: np.ndarray) -> list[float]:
            return [0.0 if self.source is not None else (u - self.R * x[0]) / self.L, 0.0, 0.0]

        return rate


def advance(plant: Plant, x: np.ndarray, s: int, u: float, span: float) -> tuple[np.ndarray, int]:
    """Integrate over a stretch of held voltage with all its events; s = 0 is rest."""
    r = plant.design.friction.breakaway_ratio
    if not any(plant.Tc.values()):  # nothing to stick to
        return solve_ivp(plant.slip(1, u), (0.0, span), x, **TIGHT).y[:, -1], 1
    t = 0.0
    while t < span:
        if s == 0:
            drive = plant.drive(x, u)
            if plant.source is not None and -plant.Tc[-1] * r <= drive <= plant.Tc[1] * r:
                return x, 0
            if drive > plant.Tc[1] * r * (1 - 1e-13):
                s = 1
            elif drive < -plant.Tc[-1] * r * (1 - 1e-13):
                s = -1
            else:
                leave = [lambda _, y, k=k: k * plant.drive(y, u) - plant.Tc[k] * r for k in (1, -1)]
                for event in leave:
                    event.terminal, event.direction = True, 1
                out = solve_ivp(plant.stick(u), (t, span), x, events=leave, **TIGHT)
                t, x = out.t[-1], out.y[:, -1]
                if out.status == 1:
                    s = 1 if out.t_events[0].size else -1
                continue
        land = lambda _, y: y[1]  # noqa: E731
        land.terminal, land.direction = True, -s
        out = solve_ivp(plant.slip(s, u), (t, span), x, events=[land], **TIGHT)
        t, x = out.t[-1], out.y[:, -1].copy()
        if out.status == 1:
            x[1] = 0.0
            drive = plant.drive(x, u)
            passes = -s * drive > plant.Tc[-s] * r
            s = -s if passes else 0
    return x, s


def reference(design: Design, voltages: np.ndarray, start: State, load_Nm: float = 0.0) -> np.ndarray:
    """States (i, w, th) at the ticks."""
    plant = Plant(design, load_Nm)
    Ts, d = design.controller.period_s, design.controller.computing_delay_s
    whole, rest = int(d / Ts + 1e-9), d - int(d / Ts + 1e-9) * Ts
    x = np.array([start.current_A, start.motor_speed_rad_s, start.motor_angle_rad])
    s = int(np.sign(x[1]))
    held = np.concatenate([np.full(whole + 1, start.voltage_V), voltages])
    out = np.empty((voltages.size, 3))
    for k in range(voltages.size):
        out[k] = x
        for u, span in ((held[k], rest), (held[k + 1], Ts - rest)):
            if span > 1e-12:
                x, s = advance(plant, x, s, float(u), span)
    return out
