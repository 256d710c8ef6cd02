"""The smallest command that moves the output, simulated beside what the controllers' gains predict."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Command, Design
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
        Steps below the threshold, where a controller integrates and none differentiates the step.
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

    Steps as they come behind profile and filter of the command, which let none through as it is.
    """
    design = replace(design, command=Command())
    static = static_threshold(design, load_Nm)
    if not 0.0 < static.forward_rad < math.inf:
        return None
    if static.integral_time_s is not None:
        place = design.controller.position_loop  # a step's own kick moves it at once
        kicks = any((place.derivative_time_s, place.feedforward, place.acceleration_feedforward,
                     place.friction_feedforward))  # fmt: skip
        return Threshold(static, () if kicks else _waiting(design, static), None, 0.0)
    sizes = static.forward_rad * np.linspace(1.0 - WITHIN, 1.0 + WITHIN, COUNT)
    moved = _first_motion_s(design, load_Nm, sizes) < math.inf
    first = float(sizes[np.argmax(moved)]) if moved.any() else None
    return Threshold(static, (), first, 2.0 * WITHIN / (COUNT - 1))


def _waiting(design: Design, static: StaticThreshold) -> tuple[Waiting, ...]:
    """Steps below the threshold and when each moves the output."""
    sizes = static.forward_rad * np.array(FRACTIONS)
    predicted = [static.waiting_time_s(float(size)) for size in sizes]
    seen = _first_motion_s(design, static.load_Nm, sizes)
    return tuple(
        Waiting(float(size), foreseen, float(time) if math.isfinite(time) else None)
        for size, foreseen, time in zip(sizes, predicted, seen, strict=True)
    )


def _first_motion_s(design: Design, load_Nm: float, sizes: np.ndarray) -> np.ndarray:
    """First time at which each step moves the motor; ``inf`` if none does."""
    rows = Rows.of(design, len(sizes))
    rows["load"] = load_Nm
    rows.step("command", sizes)
    return np.array([first_motion_s(rows.running(k)) for k in range(len(sizes))])
