"""The stiffness put to the simulator: by its own derivative, and a moment injected at the output."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, sqrt

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, UnstableError
from actuator_lti.loops.stiffness import LOST_MOTION_SHARE, compliance, lost_motion_rad, stiffness_at
from analyses.stiffness.result import AtRest, Check, LostMotion
from nonlinear import commands, simulate, tangent
from nonlinear.bench.loop_setup import LoopSetup
from nonlinear.bench.on_the_bench import on_the_bench
from nonlinear.bench.operating_motion import standing
from nonlinear.loads import series

_MOST_TICKS = 400_000
SKIPPED = 6  # periods at rest, before one is looked at
PERIODS_WITHIN = 10


def check_stiffness(design: Design, frequencies_hz: Sequence[float]) -> tuple[Check, ...]:
    """The simulator's own derivative from the load to the output (`nonlinear.tangent`) beside the loops.

    At rest, without dry friction, play, counts and friction of two slopes.  An output that no moment moves is
    pushed with the largest load moment.

    Raises
    ------
    UnstableError
        For a loop that is not stable.
    """
    coupling, bench = design.coupling, on_the_bench(design)
    friction = replace(design.friction, load_coefficient=0.0, points=(), viscous_reverse_Nms_rad=None)
    coupling = None if coupling is None else replace(coupling, play_rad=0.0)
    bench = replace(bench, coupling=coupling, friction=friction)
    setup = LoopSetup(bench, "load", standing(bench), limits_on=False)
    response, hertz = compliance(bench, setup.bias.operating(bench)), np.asarray(frequencies_hz, dtype=float)
    if float(response.slowest) >= 1.0:
        raise UnstableError("stiffness: the closed loop is not stable")
    if not response.moves:
        pushed = stiffness_at_rest(bench, [(each, design.load.moment_max_Nm or 1.0) for each in hertz])
        return tuple(Check(one.frequency_hz, complex(np.inf), one.seen_Nm_rad) for one in pushed)
    found = tangent(bench, "load", setup=setup)
    seen = 1.0 / found.closed(np.exp(2j * np.pi * hertz * found.hold_s))
    foreseen = [complex(stiffness_at(response, each)[0]) for each in hertz]
    return tuple(map(Check, hertz.tolist(), foreseen, seen.tolist()))


def stiffness_at_rest(design: Design, asked: Sequence[tuple[float, float]]) -> tuple[AtRest, ...]:
    """Fundamental stiffness of the drive as it is, command held, at (frequency in Hz, moment in N m)."""
    made = []
    for frequency, moment in asked:
        every = design.controller.position_loop.every  # a period is a whole number of them
        ticks = max(4, round(1.0 / (frequency * design.controller.period_s * every))) * every
        K = _injected(design, moment, ticks)
        made.append(AtRest(moment, 1.0 / (ticks * design.controller.period_s), K))
    return tuple(made)


def _injected(design: Design, amplitude: float, ticks: int) -> complex:
    """Stiffness seen at a moment of a period of so many ticks, after some periods."""
    period, count = design.controller.period_s, (SKIPPED + 2) * ticks
    turn = np.exp(-2j * np.pi * np.arange(ticks) / ticks)
    moment = np.tile(-amplitude * turn.imag, SKIPPED + 2)
    run = simulate(design, commands.hold(), count * period, series(np.arange(count) * period, moment))
    seen = run.output_angle_rad[SKIPPED * ticks :].reshape(2, ticks) @ turn
    given = moment[SKIPPED * ticks :].reshape(2, ticks) @ turn
    return complex(given.sum() / seen.sum()) if seen.sum() != 0.0 else complex(np.inf)


def lost_motion(design: Design, *, seen: bool = False) -> LostMotion | None:
    """Lost motion of a coupling (`actuator_lti.loops.stiffness`); None for a rigid drive train."""
    if design.coupling is None:
        return None
    play = design.coupling.play_rad / design.ratio_behind_coupling
    read = lost_motion_seen(design) if seen and design.load.moment_max_Nm > 0.0 else None
    return LostMotion(play, lost_motion_rad(design), read)


def lost_motion_seen(design: Design) -> float:
    """Lost motion in the simulator, the motor's sensor holding: 0, + peak, - peak, + peak, slowly.

    The peak is the largest load moment, or thrice what the load's friction breaks away at.  It is slow enough
    for `PERIODS_WITHIN` oscillations of the load within the part that is read.

    Raises
    ------
    InputError
        Without a coupling, a position loop or a largest load moment.
    """
    coupling, friction, rated = design.coupling, design.load.friction, design.load.moment_max_Nm
    if coupling is None or design.controller.position is None or rated <= 0.0:
        raise InputError("stiffness: lost motion needs a coupling, a position loop and load.moment_max")
    dry = friction.dry_torque_Nm * friction.breakaway_ratio if friction else 0.0
    peak = max(rated, 3.0 * dry * design.ratio_behind_coupling)
    share = LOST_MOTION_SHARE * rated / peak
    held = replace(
        design,
        controller=replace(design.controller, position=replace(design.controller.position, sensor="motor")),
        load=design.load.bare(),
    )
    turn_s = 2.0 * np.pi * sqrt(design.load_side_inertia_kgm2 / coupling.stiffness_Nm_rad)
    ticks = min(ceil(PERIODS_WITHIN * turn_s / (share * design.controller.period_s)), _MOST_TICKS)
    quarter = ticks * design.controller.period_s
    loading = series(quarter * np.array([0.0, 1.0, 3.0, 5.0]), peak * np.array([0.0, 1.0, -1.0, 1.0]))
    every = max(ticks // 4000, 1)
    run = simulate(held, commands.hold(), 5.0 * quarter, loading, record_every=every)
    twist = run.output_angle_rad - run.motor_angle_rad / design.total_ratio
    at = quarter * np.array([2.0 - share, 4.0 + share, 2.0 + share, 4.0 - share])
    read = np.interp(at, run.time_s, twist)
    return float(0.5 * (read[0] + read[1] - read[2] - read[3]))
