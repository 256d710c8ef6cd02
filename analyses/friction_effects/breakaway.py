"""The smallest command that moves the output, simulated beside what the controllers' gains foresee."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from actuator_lti.design.model import Design
from analyses.static_threshold import StaticThreshold, static_threshold
from nonlinear import Rows

FRACTIONS = (0.2, 0.3, 0.5, 0.7, 0.9)
WITHIN, COUNT = 0.05, 51
ROOM = 1.5


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
        What the gains foresee.
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


def threshold(design: Design, load_Nm: float, settling_ticks: int) -> Threshold | None:
    """Simulate steps around the threshold; ``None`` where a forward step has none (or never moves)."""
    static = static_threshold(design, load_Nm)
    if not 0.0 < static.forward_rad < math.inf:
        return None
    if static.integral_time_s is not None:
        kicks = design.controller.position_loop.derivative_time_s > 0.0  # a step's own kick moves it at once
        return Threshold(static, () if kicks else _waiting(design, static), None, 0.0)
    sizes = static.forward_rad * np.linspace(1.0 - WITHIN, 1.0 + WITHIN, COUNT)
    moved = _first_motion_s(design, load_Nm, sizes, 4 * settling_ticks) < math.inf
    first = float(sizes[np.argmax(moved)]) if moved.any() else None
    return Threshold(static, (), first, 2.0 * WITHIN / (COUNT - 1))


def _waiting(design: Design, static: StaticThreshold) -> tuple[Waiting, ...]:
    """Steps below the threshold and when each moves the output."""
    sizes = static.forward_rad * np.array(FRACTIONS)
    predicted = [static.waiting_time_s(float(size)) for size in sizes]
    ticks = math.ceil(ROOM * max(predicted) / design.controller.period_s) + 200
    seen = _first_motion_s(design, static.load_Nm, sizes, ticks)
    return tuple(
        Waiting(float(size), foreseen, float(time) if math.isfinite(time) else None)
        for size, foreseen, time in zip(sizes, predicted, seen, strict=True)
    )


def _first_motion_s(design: Design, load_Nm: float, sizes: np.ndarray, ticks: int) -> np.ndarray:
    """First time at which each step moves the output; ``inf`` if not within so many ticks.

    Bisection over the length of the run, all steps at once: a run that ends before the motion leaves the
    angle untouched.
    """
    rows = Rows.of(design, len(sizes))
    rows["load"] = load_Nm
    rows.step("command", sizes)
    none, some = np.zeros(len(sizes)), np.full(len(sizes), float(ticks))
    rows["ticks"] = ticks
    moving = _moved(rows)
    while (some - none).max() > 1.0:
        middle = np.floor(0.5 * (none + some))
        rows["ticks"] = np.maximum(middle, 1.0)
        hit = _moved(rows)
        some, none = np.where(hit, middle, some), np.where(hit, none, middle)
    return np.where(moving, some * design.controller.period_s, np.inf)


def _moved(rows: Rows) -> np.ndarray:
    return np.asarray(rows.run().final_motor_angle_rad != 0.0)
