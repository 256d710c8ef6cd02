"""Limit cycles foreseen by the describing function of dry friction inside the exact sampled loop.

For a sinusoidal speed of amplitude W dry friction acts as the slope ``4 Tc/(pi W)``.  A limit cycle is
foreseen where an eigenvalue of the whole closed loop with that slope lies on the unit circle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.operating import Operating, dry_torque
from actuator_lti.drive.wiring import wire
from actuator_lti.loops.tick import TickProgram

POINTS = 36
DECADES = 6.0
BORDER = 1e-9


@dataclass(frozen=True)
class ForeseenCycle:
    """A limit cycle by describing function.

    Attributes
    ----------
    speed_amplitude_rad_s : float
        W, motor side, peak.
    output_amplitude_rad : float
        Of the output angle, peak.
    frequency_hz : float
    stable : bool
        Whether motion near it comes nearer. ``False``: smaller motion dies out, larger motion grows, so it
        is the border of what friction keeps quiet.
    state : dict of str to complex
        Shape of the oscillation by state of the loop, for a motor speed of 1.
    """

    speed_amplitude_rad_s: float
    output_amplitude_rad: float
    frequency_hz: float
    stable: bool
    state: dict[str, complex]


def foreseen_cycles(design: Design, load_Nm: float, top_speed_rad_s: float) -> tuple[ForeseenCycle, ...]:
    """Find every limit cycle with a motor speed up to ``top_speed_rad_s``, over six decades.

    The breakaway torque has no part in it: at rest a sinusoid spends no time.
    """
    from scipy.optimize import brentq

    def excess(log_speed: float) -> float:
        return _radius(design, load_Nm, math.exp(log_speed))[0] - 1.0

    grid = math.log(top_speed_rad_s) - np.linspace(DECADES, 0.0, POINTS) * math.log(10.0)
    values = [excess(float(point)) for point in grid]
    result = []
    for k in range(len(grid) - 1):
        a, b = values[k], values[k + 1]
        if a * b < 0.0 and max(abs(a), abs(b)) > BORDER:
            root = float(brentq(excess, grid[k], grid[k + 1], xtol=1e-12))
            result.append(_cycle(design, load_Nm, math.exp(root), stable=a > 0.0))
    return tuple(cycle for cycle in result if cycle.frequency_hz > 0.0)


def at_load(cycle: ForeseenCycle, design: Design, from_load_Nm: float, load_Nm: float) -> ForeseenCycle:
    """The same cycle at another load torque: the slope at the border is the same, so W goes with Tc."""
    ratio = _mean_dry(design, load_Nm) / _mean_dry(design, from_load_Nm)
    return replace(
        cycle,
        speed_amplitude_rad_s=ratio * cycle.speed_amplitude_rad_s,
        output_amplitude_rad=ratio * cycle.output_amplitude_rad,
    )


def _mean_dry(design: Design, load_Nm: float) -> float:
    return 0.5 * float(dry_torque(design, load_Nm, 1) + dry_torque(design, load_Nm, -1))


def _matrix(design: Design, load_Nm: float, speed: float) -> tuple[np.ndarray, tuple[str, ...], float]:
    """Give the closed loop over one position period, with its states and that period."""
    known: dict[tuple[bool, ...], np.ndarray] = {}
    wired = wire(design, Operating(point="describing-function", load_Nm=load_Nm, speed_amplitude_rad_s=speed))
    program = TickProgram(wired, "position")
    A = np.eye(len(program.states))
    for k in range(program.ticks):
        kind = tuple(k % every == 0 for every in wired.interval.values())
        if kind not in known:
            known[kind] = program.tick(k).A
        A = known[kind] @ A
    return A, program.states, wired.period_s("position")


def _radius(design: Design, load_Nm: float, speed: float) -> tuple[float, complex]:
    """Give the largest eigenvalue: its magnitude and itself."""
    values = np.linalg.eigvals(_matrix(design, load_Nm, speed)[0])
    largest = values[np.argmax(np.abs(values))]
    return float(abs(largest)), complex(largest)


def _cycle(design: Design, load_Nm: float, speed: float, *, stable: bool) -> ForeseenCycle:
    """Describe the cycle at a speed amplitude that puts an eigenvalue on the unit circle."""
    A, names, period = _matrix(design, load_Nm, speed)
    values, vectors = np.linalg.eig(A)
    place = int(np.argmax(np.abs(values)))
    omega = abs(float(np.angle(values[place]))) / period
    shape = vectors[:, place]
    if np.angle(values[place]) < 0.0:
        shape = shape.conj()
    shape = shape / shape[names.index("w")]
    state = {name: complex(value) for name, value in zip(names, shape, strict=True)}
    angle = abs(state["th"]) * speed / design.total_ratio
    return ForeseenCycle(speed, angle, omega / (2.0 * math.pi), stable, state)
