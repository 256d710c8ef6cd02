"""The smallest command that moves the output, simulated beside what the controllers' gains predict."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Command, Design
from actuator_lti.drive.angle import holding_torque_Nm
from analyses.linear.static_threshold import StaticThreshold, static_threshold
from nonlinear import Rows
from nonlinear.settling.rest import first_motion_s

FRACTIONS = (0.2, 0.3, 0.5, 0.7, 0.9)
WITHIN, COUNT = 0.05, 51


@dataclass(frozen=True)
class Waiting:
    """A step below the threshold: how long the speed controller must integrate until the output moves."""

    amplitude_rad: float
    predicted_s: float
    simulated_s: float | None


@dataclass(frozen=True)
class Threshold:
    """Threshold of motion at one load torque.

    Attributes
    ----------
    static : StaticThreshold
        What the gains predict.
    waiting : tuple of Waiting
        Steps below the threshold, where a controller integrates and no kick of a step moves it at once.
    simulated_rad : float or None
        Smallest forward step that ever moves the output, where nothing integrates.
    resolution : float
        Of ``simulated_rad``, relative.
    """

    static: StaticThreshold
    waiting: tuple[Waiting, ...]
    simulated_rad: float | None
    resolution: float


def threshold(design: Design, load_Nm: float) -> Threshold | None:
    """Simulate steps around the threshold; ``None`` where a forward step has none (or never moves).

    Steps as they come behind profile and filter of the command, which let none through as it is. It is the
    motor that starts, from angle zero: what dry friction holds behind a spring follows later.
    """
    design = replace(design, command=Command())
    moment = load_Nm + float(design.load.moment_Nm(0.0))
    static = static_threshold(_motor_alone(design), moment)
    if not 0.0 < static.forward_rad < math.inf:
        return None
    if design.controller.position_loop.kicks:
        return Threshold(static, (), None, 0.0)  # a step's own kick moves it at once
    if static.integral_time_s is not None:
        return Threshold(static, _waiting(design, load_Nm, static), None, 0.0)
    sizes = static.forward_rad * np.linspace(1.0 - WITHIN, 1.0 + WITHIN, COUNT)
    moved = _first_motion_s(design, load_Nm, sizes) < math.inf
    first = float(sizes[np.argmax(moved)]) if moved.any() else None
    return Threshold(static, (), first, 2.0 * WITHIN / (COUNT - 1))


def _motor_alone(design: Design) -> Design:
    """The drive at angle zero: its own torque there an offset, no friction behind the spring."""
    friction = design.friction
    offset = friction.offset_torque_Nm + holding_torque_Nm(design)
    return replace(
        design,
        motor=design.motor.level(),
        load=replace(design.load.level(), friction=None),
        friction=replace(friction, offset_torque_Nm=offset),
    )


def _waiting(design: Design, load_Nm: float, static: StaticThreshold) -> tuple[Waiting, ...]:
    """Steps below the threshold and when each moves the output."""
    sizes = static.forward_rad * np.array(FRACTIONS)
    predicted = [static.waiting_time_s(float(size)) for size in sizes]
    seen = _first_motion_s(design, load_Nm, sizes)
    return tuple(
        Waiting(float(size), foreseen, float(time) if math.isfinite(time) else None)
        for size, foreseen, time in zip(sizes, predicted, seen, strict=True)
    )


def _first_motion_s(design: Design, load_Nm: float, sizes: np.ndarray) -> np.ndarray:
    """First time at which each step moves the motor; ``inf`` if none does. A spring carries the load already.

    The sensor that the position loop has stands at zero.
    """
    rows = Rows.of(design, len(sizes))
    rows["load"] = load_Nm
    rows.step("command", sizes)
    if design.coupling is not None:
        moment, behind = load_Nm + float(design.load.moment_Nm(0.0)), design.load.friction
        offset = 0.0 if behind is None else behind.offset_torque_Nm
        twist = design.coupling.twist_rad(offset - moment / design.ratio_behind_coupling)
        rows["twist_start"] = twist
        if design.controller.position_loop.sensor == "output":
            rows["angle_start"] = design.ratio_to_coupling * twist
    return np.array([first_motion_s(rows.running(k)) for k in range(len(sizes))])
