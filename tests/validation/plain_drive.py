"""A rigid drive in plain Python: the controller of the equations, the plant by Runge-Kutta, tick by tick.

It shares nothing with the simulator: what it shows of a finding is independent of it.
"""

from __future__ import annotations

import importlib.util
from math import ceil, tanh
from pathlib import Path
from types import ModuleType

import numpy as np

from actuator_lti.design.model import Design

PLACE = Path(__file__).parents[1] / "nonlinear" / "controller_reference.py"


def _reference() -> ModuleType:
    """The plain controller of the simulator's own tests."""
    spec = importlib.util.spec_from_file_location("controller_reference_of_validation", PLACE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    import sys

    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def output_of_step(design: Design, size_rad: float, ticks: int, parts: int = 4) -> np.ndarray:
    """The output angle (rad) at every tick after a step of the command from rest.

    For a rigid drive: J dw/dt = kM i - F(w) - b w + c th, L di/dt = u - R i - kE w, u the controller's
    voltage, one computing delay late.  F is Tc tanh(w/w_s), or Tc sign(w): then a part of a tick that would
    reverse the speed ends at rest, where the drive stays until the torque exceeds that of breakaway.
    """
    motor, friction, N = design.effective_motor, design.friction, design.total_ratio
    R, L = motor.resistance_ohm or 0.0, motor.inductance_H or 1.0
    kM, kE = motor.torque_constant_Nm_A or 0.0, motor.back_emf_constant_Vs_rad or 0.0
    J, b = design.inertia_kgm2, friction.viscous_Nms_rad
    Tc, ws, off = friction.dry_torque_Nm, friction.smoothing_speed_rad_s, friction.offset_torque_Nm
    back = Tc if friction.dry_torque_reverse_Nm is None else friction.dry_torque_reverse_Nm
    switching = friction.law == "coulomb" and Tc > 0.0
    assert design.coupling is None
    assert not friction.points
    slope = design.load.moment_slope_Nm_rad / N**2 if design.load.path == "back-drivable" else 0.0
    sense = 0.0  # of the motion, for the switching law

    def rate(x: tuple[float, float, float], u: float) -> tuple[float, float, float]:
        i, w, th = x
        dry = Tc * tanh(w / ws) if Tc and not switching else 0.0
        if switching:
            dry = Tc if sense > 0.0 else -back
        bent = 0.0 if switching and sense == 0.0 else (kM * i - dry - b * w - off + slope * th) / J
        return (u - R * i - kE * w) / L, bent, w

    def sense_of(x: tuple[float, float, float]) -> float:
        if x[1] != 0.0:
            return 1.0 if x[1] > 0.0 else -1.0
        torque = kM * x[0] - off + slope * x[2]
        loose = (Tc if torque > 0.0 else back) * friction.breakaway_ratio
        return 0.0 if abs(torque) <= loose else (1.0 if torque > 0.0 else -1.0)

    def run(x: tuple[float, float, float], u: float, span: float) -> tuple[float, float, float]:
        nonlocal sense
        n = max(ceil(parts * span / Ts), 1)
        h = span / n
        for _ in range(n):
            sense = sense_of(x)
            k1 = rate(x, u)
            k2 = rate(tuple(a + 0.5 * h * k for a, k in zip(x, k1, strict=True)), u)  # type: ignore[arg-type]
            k3 = rate(tuple(a + 0.5 * h * k for a, k in zip(x, k2, strict=True)), u)  # type: ignore[arg-type]
            k4 = rate(tuple(a + h * k for a, k in zip(x, k3, strict=True)), u)  # type: ignore[arg-type]
            slopes = zip(k1, k2, k3, k4, strict=True)
            x = tuple(  # type: ignore[assignment]
                a + h / 6.0 * (p + 2.0 * q + 2.0 * r + s) for a, (p, q, r, s) in zip(x, slopes, strict=True)
            )
            if switching and x[1] * sense < 0.0:
                x = (x[0], 0.0, x[2])
        return x

    Ts, delay = design.controller.period_s, design.controller.computing_delay_s
    whole = int(delay / Ts + 1e-9)
    part = delay - whole * Ts
    control = _reference().Controller(design)
    line, x, out = [0.0] * (whole + 1), (0.0, 0.0, 0.0), np.empty(ticks)
    for k in range(ticks):
        out[k] = x[2] / N
        line = [control.tick(size_rad, *x, x[2] / N), *line][: whole + 2]
        if part > 1e-9 * Ts:
            x = run(x, line[whole + 1], part)
        x = run(x, line[whole], Ts - part)
    return out
