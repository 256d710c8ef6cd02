"""Controllers in the steady state of an operating motion: integrators, states of a law, commands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.drive.steady import fed_forward, filtered

if TYPE_CHECKING:
    from nonlinear.bench.operating_motion import OperatingMotion

COMMANDED = 0.7  # of a limit that a command may take
CONSISTENT = 1e-9  # of the largest term of an equation: what rounding leaves of it


def commands_fit(design: Design, motion: OperatingMotion) -> bool:
    """Whether commands leave room to the limits: a controller without an integral needs an error."""
    # what a law of one's own needs is its own affair: it is tested with the limits lifted
    limits, wanted = design.limits, motion.voltage_V
    for stage, limit in (("current", limits.peak_current_A), ("velocity", limits.speed_rad_s)):
        loop = getattr(design.controller, stage)
        if loop is not None and loop.law is not None:
            wanted = motion.current_A
        elif loop is not None:
            wanted = steady_state(design, motion, stage, wanted).command
            if abs(wanted) > COMMANDED * limit:
                return False
    return True


@dataclass(frozen=True)
class Steady:
    """A controller in its steady state: its command, its integrator, and its output before filters."""

    command: float
    integrator: float
    output: float


def steady_state(design: Design, bias: OperatingMotion, stage: str, wanted: float) -> Steady:
    """The current or velocity controller on a motion, where its output behind the filters is ``wanted``."""
    loop, w = getattr(design.controller, stage), bias.speed_rad_s
    if stage == "current":
        (direct, per_speed), gain, seen, output = fed_forward(design), loop.gain_V_A, bias.current_A, wanted
    else:
        direct, per_speed, gain = 0.0, 0.0, loop.gain
        seen, output = float(w * filtered(design, "speed")), float(wanted / filtered(design, "torque"))
    rest = output - per_speed * w - direct * seen
    if loop.integral_time_s is not None:
        return Steady(seen, rest, output)
    return Steady(seen + rest / (gain + direct), 0.0, output)


@dataclass(frozen=True)
class OwnStart:
    """Where a law of one's own starts."""

    states: npt.NDArray[np.float64]  # zero where the motion has no steady state of the law
    command: float  # of the stage at the start, motor side
    steady: bool  # whether it is in its steady state: with angles that grow, its states grow evenly


def own_start(design: Design, bias: OperatingMotion, wanted: float) -> OwnStart:
    """Solve for states x_k = x0 + k x1 and the command of a law of one's own whose stage gives ``wanted``."""
    own = design.controller.own_law
    assert own is not None
    stage, law = own
    A, B, C, D, _ = law.sampled
    n, gain = len(A), law.gain
    T = design.controller.period_of(stage)
    direct, per_speed = fed_forward(design) if stage == "current" else (0.0, 0.0)
    e0, e1, per_command = (
        np.array([part.get(name, 0.0) for name in law.inputs]) for part in _inputs(design, stage, bias, T)
    )
    eye, none = np.eye(n), np.zeros((n, n))
    table = np.block([
        [none, eye - A, np.zeros((n, 1))],
        [np.zeros((1, n)), gain * C[None], np.zeros((1, 1))],
        [eye - A, eye, -(B @ per_command)[:, None]],
        [gain * C[None], np.zeros((1, n)), np.array([[gain * (D @ per_command) + direct]])],
    ])  # fmt: skip
    left = wanted - gain * (D @ e0) - per_speed * bias.speed_rad_s
    right = np.concatenate([B @ e1, [-gain * (D @ e1)], B @ e0, [left]])
    scale = np.abs(table).max(axis=1)
    scale[scale < np.finfo(float).tiny] = 1.0  # of what nothing moves: what is wanted of it stays
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
    start = {"error": -measured, "speed": w, "current": bias.current_A, "output_angle": output,
             "output_speed": w / N, "twist": -design.ratio_behind_coupling * output}  # fmt: skip
    gained = {"angle": w * T, "output_angle": w * T / N, "command": w * T if stage == "position" else 0.0}
    return start, gained, {"command": 1.0, "error": 1.0}
