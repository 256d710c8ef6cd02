"""Controllers in the steady state of an operating motion: integrators, states of a law, commands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design, FilterPlace
from nonlinear.row.filters import section

if TYPE_CHECKING:
    from nonlinear.bench.operating_motion import OperatingMotion

COMMANDED = 0.7  # of a limit that a command may take
CONSISTENT = 1e-9  # of the largest term of an equation: what rounding leaves of it


def commands_fit(design: Design, motion: OperatingMotion) -> bool:
    """Whether commands leave room to the limits: a controller without an integral needs an error.

    What a law of one's own needs is its own affair: it is tested with the limits lifted.
    """
    control, limits = design.controller, design.limits
    wanted = motion.voltage_V
    if control.current is not None and control.current.law is not None:
        wanted = motion.current_A
    elif control.current is not None:
        loop = control.current
        state = current_state(
            motion,
            loop.gain_V_A,
            loop.integral_time_s is not None,
            loop.back_emf_feedforward * (design.effective_motor.back_emf_constant_Vs_rad or 0.0),
            loop.resistance_feedforward * (design.effective_motor.resistance_ohm or 0.0),
        )
        wanted = float(state.command)
        if abs(wanted) > COMMANDED * limits.peak_current_A:
            return False
    if control.velocity is not None and control.velocity.law is None:
        velocity = control.velocity
        integral = velocity.integral_time_s is not None
        wanted = float(velocity_state(design, motion, wanted, velocity.gain, integral).command)
        return abs(wanted) <= COMMANDED * limits.speed_rad_s
    return True


@dataclass(frozen=True)
class Steady:
    """A controller in its steady state: its command, its integrator, and its output before filters."""

    command: float
    integrator: float
    output: float


def current_state(
    bias: OperatingMotion, gain: float, integral: bool, back_emf: float, resistance: float
) -> Steady:
    """The current controller on an operating motion; the last two are feed-forward in V s/rad and ohm."""
    i, left = bias.current_A, bias.voltage_V - back_emf * bias.speed_rad_s
    if integral:
        return Steady(i, left - resistance * i, bias.voltage_V)
    return Steady((left + gain * i) / (gain + resistance), 0.0, bias.voltage_V)


def velocity_state(
    design: Design, bias: OperatingMotion, wanted: float, gain: float, integral: bool
) -> Steady:
    """The velocity controller on an operating motion whose output behind the filters is ``wanted``."""
    before = wanted / steady_gain(design, "torque")
    seen = bias.speed_rad_s * steady_gain(design, "speed")
    return Steady(seen, before, before) if integral else Steady(seen + before / gain, 0.0, before)


def steady_gain(design: Design, place: FilterPlace) -> float:
    """Gain at zero frequency of the filters of the velocity loop on the torque or the speed."""
    velocity = design.controller.velocity
    if velocity is None:
        return 1.0
    result, period_s = 1.0, velocity.every * design.controller.period_s
    for item in velocity.filters_on(place):
        b0, b1, b2, a1, a2 = section(item, period_s)
        result *= (b0 + b1 + b2) / (1.0 + a1 + a2)
    return result


@dataclass(frozen=True)
class OwnStart:
    """Where a law of one's own starts."""

    states: npt.NDArray[np.float64]  # zero where the motion has no steady state of the law
    command: float  # of the stage at the start, motor side
    steady: bool  # whether it is in its steady state: with angles that grow, its states grow evenly


def own_start(
    design: Design, bias: OperatingMotion, wanted: float, gain: float, direct: float = 0.0, fed: float = 0.0
) -> OwnStart:
    """Solve for states x_k = x0 + k x1 and the command of a law times ``gain`` whose stage gives ``wanted``.

    The stage adds ``direct`` per command to the law's output, and ``fed`` besides.
    """
    own = design.controller.own_law
    assert own is not None
    stage, law = own
    A, B, C, D, _ = law.sampled
    n, T = len(A), design.controller.period_s * getattr(getattr(design.controller, stage), "every", 1)
    e0, e1, per_command = (
        np.array([part[name] for name in law.inputs]) for part in _inputs(design, stage, bias, T)
    )
    eye, none = np.eye(n), np.zeros((n, n))
    table = np.block([
        [none, eye - A, np.zeros((n, 1))],
        [np.zeros((1, n)), gain * C[None], np.zeros((1, 1))],
        [eye - A, eye, -(B @ per_command)[:, None]],
        [gain * C[None], np.zeros((1, n)), np.array([[gain * (D @ per_command) + direct]])],
    ])  # fmt: skip
    right = np.concatenate([B @ e1, [-gain * (D @ e1)], B @ e0, [wanted - gain * (D @ e0) - fed]])
    scale = np.maximum(np.abs(table).max(axis=1), np.finfo(float).tiny)
    table, right = table / scale[:, None], right / scale
    found = np.linalg.lstsq(table, right, rcond=None)[0]
    size = np.abs(table) @ np.abs(found) + np.abs(right)
    steady = bool((np.abs(table @ found - right) <= CONSISTENT * size).all())
    return OwnStart(found[:n], float(found[-1]), True) if steady else OwnStart(np.zeros(n), 0.0, False)


def _inputs(design: Design, stage: str, bias: OperatingMotion, T: float) -> tuple[dict[str, float], ...]:
    """The signals at the start without a command, what they gain in a period, and of a command of one."""
    w, N = bias.speed_rad_s, design.total_ratio
    output = bias.output_rad(design)
    at_output = stage == "position" and design.controller.position_loop.sensor == "output"
    measured = {"position": N * output if at_output else 0.0, "velocity": w, "current": bias.current_A}[stage]
    start = {
        "command": 0.0, "error": -measured, "speed": w, "angle": 0.0, "current": bias.current_A,
        "output_angle": output, "output_speed": w / N,
    }  # fmt: skip
    gained = dict.fromkeys(start, 0.0) | {"angle": w * T, "output_angle": w * T / N}
    if stage == "position":
        gained["command"] = w * T
    return start, gained, dict.fromkeys(start, 0.0) | {"command": 1.0, "error": 1.0}
