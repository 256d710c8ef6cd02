"""Cycles of play and quantisation by describing function inside the exact sampled loop.

Play: the coupling's torque is a dead zone of the twist.  For a twist of amplitude A its fundamental is that
of the coupling with k and c times ``n(x) = 1 - (2/pi)(asin x + x sqrt(1 - x^2))``, x = b/A (the damping acts
in contact only, and its share is the same n).  A cycle is foreseen where an oscillating eigenvalue of the
closed loop lies on the unit circle.  Dry friction of either side adds ``4 Tc/(pi W)``, W the amplitude of its
speed in the same cycle; friction by load is left out.

Quantisation: an angle that swings about the edge of a count is a relay of one count, ``2 q/(pi A)`` up to
A = q.  The sensor of the output multiplies the loop at the output by it, so a cycle is foreseen at the upper
gain border g of that loop: ``A = 2 q/(pi g)``, stable.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import asin, exp, log, pi, sqrt

import numpy as np
from scipy.optimize import brentq

from actuator_lti.design.model import Coupling, Design, Friction, LoadFriction
from actuator_lti.drive.operating import Operating, slope_at
from actuator_lti.drive.wiring import wire
from actuator_lti.loops import assemble_loops
from actuator_lti.loops.periodic import exact_margins, point_blocks
from actuator_lti.loops.tick import TickProgram
from analyses.limit_cycles.result import Cycle

LEAST, MOST, POINTS = 1.02, 300.0, 48  # of the half play: amplitudes of the twist that are looked at
_TURNS = 1e-6  # least angle of an eigenvalue that oscillates
_STEPS = 60  # of the fixed point between the amplitudes of both speeds


@dataclass(frozen=True)
class _Mode:
    """The least damped oscillation of the loop over a position period."""

    radius: float
    frequency_hz: float
    shape: dict[str, complex]  # for a twist of 1


def dead_zone(x: float) -> float:
    """Share of the stiffness that a dead zone of half width x times the amplitude leaves.

    Examples
    --------
    >>> dead_zone(0.0), dead_zone(1.0), round(dead_zone(0.5), 6)
    (1.0, 0.0, 0.391002)
    """
    return 0.0 if x >= 1.0 else 1.0 - 2.0 / pi * (asin(x) + x * sqrt(1.0 - x * x))


def cycles_of_play(design: Design, *, friction: bool) -> tuple[Cycle, ...]:
    """Every cycle with a twist between `LEAST` and `MOST` times the half play, smallest first."""
    coupling = design.coupling
    if coupling is None or coupling.play_rad <= 0.0 or design.controller.position is None:
        return ()
    half = 0.5 * coupling.play_rad
    grid = np.geomspace(LEAST * half, MOST * half, POINTS)
    modes: list[_Mode | None] = []
    for A in grid:
        modes.append(_at_twist(design, float(A), friction, modes[-1] if modes else None))
    result = []
    for k in range(POINTS - 1):
        a, b = modes[k], modes[k + 1]
        if a is None or b is None or (a.radius - 1.0) * (b.radius - 1.0) >= 0.0:
            continue
        made = _border(design, friction, (float(grid[k]), float(grid[k + 1])), a)
        if made is not None and made[1].frequency_hz > 0.0:
            result.append(_cycle(design, *made, friction, stable=a.radius > 1.0))
    return tuple(result)


def _border(
    design: Design, friction: bool, ends: tuple[float, float], near: _Mode
) -> tuple[float, _Mode] | None:
    """The twist between two amplitudes at which the oscillation keeps its size, and its shape there."""

    def mode(log_A: float) -> _Mode | None:
        return _at_twist(design, exp(log_A), friction, near)

    def excess(log_A: float) -> float:
        result = mode(log_A)
        return -1.0 if result is None else result.radius - 1.0

    low, high = map(log, ends)
    if excess(low) * excess(high) >= 0.0:
        return None
    root = float(brentq(excess, low, high, xtol=1e-8))
    there = mode(root)
    return None if there is None else (exp(root), there)


def _at_twist(design: Design, A: float, friction: bool, near: _Mode | None) -> _Mode | None:
    """The least damped oscillation at a twist of amplitude A, the speeds in it being its own.

    With friction a fixed point, begun with the shape of an oscillation ``near``.
    """
    speeds = _speeds(near, A)
    for _ in range(_STEPS):
        mode = _mode(_equivalent(design, A, *speeds, friction))
        if mode is None or not friction:
            return mode
        now = _speeds(mode, A)
        if max(abs(log(new / old)) for new, old in zip(now, speeds, strict=True)) < 1e-7:
            break
        speeds = now[0] ** 0.6 * speeds[0] ** 0.4, now[1] ** 0.6 * speeds[1] ** 0.4
    return mode


def _speeds(mode: _Mode | None, A: float) -> tuple[float, float]:
    """Amplitudes of the motor's and the load's speed at a twist of amplitude A."""
    if mode is None:
        return 1.0, 1.0
    return max(A * abs(mode.shape["w"]), 1e-12), max(A * abs(mode.shape["W"]), 1e-12)


def _equivalent(design: Design, A: float, W: float, W_l: float, friction: bool) -> Design:
    """The linear drive of the same fundamentals."""
    coupling, behind = design.coupling, design.load.friction or LoadFriction()
    assert coupling is not None
    n = dead_zone(0.5 * coupling.play_rad / A)
    own = replace(design.friction, load_coefficient=0.0)
    slope = own.viscous_Nms_rad
    if friction:
        at = Operating(point="describing-function", speed_amplitude_rad_s=W)
        slope = slope_at(replace(design, friction=own), at)
    load_slope = behind.viscous_Nms_rad + (4.0 * behind.dry_torque_Nm / (pi * W_l) if friction else 0.0)
    return replace(
        design,
        coupling=Coupling(
            stiffness_Nm_rad=n * coupling.stiffness_Nm_rad,
            damping_Nms_rad=n * coupling.damping_Nms_rad,
            after=coupling.after,
        ),
        friction=Friction(viscous_Nms_rad=slope),
        load=replace(design.load, friction=LoadFriction(viscous_Nms_rad=load_slope)),
    )


def _mode(design: Design) -> _Mode | None:
    """The largest eigenvalue off the positive real axis; None without any."""
    program = TickProgram(wire(design, Operating()), "position")
    values, vectors = np.linalg.eig(_over_a_period(program))
    turning = np.flatnonzero(np.angle(values) > _TURNS)
    if not turning.size:
        return None
    k = int(turning[np.argmax(np.abs(values[turning]))])
    names = program.states
    shape = vectors[:, k] / vectors[names.index("twist"), k]
    frequency = float(np.angle(values[k])) / (2.0 * pi * program.ticks * design.controller.period_s)
    return _Mode(float(abs(values[k])), frequency, dict(zip(names, map(complex, shape), strict=True)))


def _over_a_period(program: TickProgram) -> np.ndarray:
    A = np.eye(len(program.states))
    for k in range(program.ticks):
        A = program.tick(k).A @ A
    return A


def _cycle(design: Design, A: float, mode: _Mode, friction: bool, *, stable: bool) -> Cycle:
    """The cycle at its amplitude; phi = th/N_c - twist."""
    state = {name: A * value for name, value in mode.shape.items()}
    output = abs(_output(design, state))
    return Cycle("play", friction, output, A, mode.frequency_hz, stable, state)


def _output(design: Design, state: dict[str, complex]) -> complex:
    if design.coupling is None:
        return state["th"] / design.total_ratio
    phi = state["th"] / design.ratio_to_coupling - state["twist"]
    return phi / design.ratio_behind_coupling


def cycles_of_quantisation(design: Design) -> tuple[Cycle, ...]:
    """The cycle about the edge of a count of the output's sensor, friction left out."""
    position, q = design.controller.position, design.output_quantum_rad
    if position is None or position.sensor != "output" or q is None:
        return ()
    free = without_nonlinearities(design)
    border = exact_margins(assemble_loops(free), "output").gain_upper
    if not np.isfinite(border):  # none, or the linear loop is unstable
        return ()
    wired = wire(free, Operating())
    blocks = point_blocks(wired, "output")
    A = np.eye(len(blocks[0].states))
    for block in blocks:
        A = (block.A - border * block.B @ block.C) @ A
    values, vectors = np.linalg.eig(A)
    turning = np.flatnonzero(np.angle(values) > _TURNS)
    k = int(turning[np.argmin(np.abs(np.abs(values[turning]) - 1.0))])
    shape = dict(zip(blocks[0].states, map(complex, vectors[:, k]), strict=True))
    amplitude = 2.0 * q / (pi * border)
    state = {name: amplitude / _output(free, shape) * value for name, value in shape.items()}
    period = wired.period_s("position")
    frequency = float(np.angle(values[k])) / (2.0 * pi * period)
    return (Cycle("quantisation", False, amplitude, amplitude, frequency, True, state),)


def without_nonlinearities(design: Design) -> Design:
    """The drive in contact, without play, friction by load and dry friction."""
    coupling, behind = design.coupling, design.load.friction
    return replace(
        design,
        coupling=None if coupling is None else replace(coupling, play_rad=0.0),
        friction=Friction(viscous_Nms_rad=design.friction.viscous_Nms_rad),
        load=replace(
            design.load,
            friction=None if behind is None else LoadFriction(viscous_Nms_rad=behind.viscous_Nms_rad),
        ),
    )
