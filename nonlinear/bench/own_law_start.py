"""A law of one's own in the steady state of an operating motion: its states, and the command it needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from nonlinear.bench.operating_motion import OperatingMotion

CONSISTENT = 1e-9  # of the largest term of an equation: what rounding leaves of it


@dataclass(frozen=True)
class OwnStart:
    """Where a law of one's own starts.

    Attributes
    ----------
    states : ndarray, shape (n,)
        Zero where the motion has no steady state of the law.
    command : float
        Command of the stage at the start, motor side.
    steady : bool
        Whether the law is in its steady state there: with angles that grow, its states grow evenly.
    """

    states: npt.NDArray[np.float64]
    command: float
    steady: bool


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
