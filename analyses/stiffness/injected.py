"""The stiffness put to the simulator: a moment injected at the output while the command stands still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, log, sqrt

import numpy as np

from actuator_lti.design.model import Design, Instruments
from actuator_lti.errors import InputError, UnstableError
from actuator_lti.loops.compliance import compliance
from actuator_lti.loops.stiffness import LOST_MOTION_SHARE, lost_motion_rad, stiffness_at
from analyses.stiffness.result import AtRest, Check, LostMotion
from nonlinear import commands, simulate
from nonlinear.loads import series

_SETTLED = 1e-7
_MOST_TICKS = 400_000
SKIPPED = 6  # periods at rest, before one is looked at
PERIODS_WITHIN = 10
_DEFLECTION = 1e-4  # of the full deflection: far inside every limit, so that a pendulum is linear too


def linear_twin(design: Design) -> Design:
    """The design without play, quantisation, noise and friction by load; the run omits the dry friction."""
    coupling = design.coupling
    return replace(
        design,
        coupling=None if coupling is None else replace(coupling, play_rad=0.0),
        friction=replace(design.friction, load_coefficient=0.0),
        encoder=replace(design.encoder, counts_per_rev=None),
        output_encoder=replace(design.output_encoder, counts_per_rev=None),
        instruments=Instruments(),
    )


def check_stiffness(design: Design, frequencies_hz: Sequence[float]) -> tuple[Check, ...]:
    """Inject a small moment of each frequency and compare.

    The frequencies are moved to whole numbers of position periods, so that the ratio of the fundamentals
    over whole periods is exact once the transient is gone. An output that no moment moves is pushed with the
    largest load moment.
    """
    twin, period = linear_twin(design), design.controller.period_s
    response = compliance(twin)
    slowest = float(response.slowest)
    if slowest >= 1.0:
        raise UnstableError("stiffness: the closed loop is not stable")
    settle = min(ceil(log(_SETTLED) / log(slowest)), _MOST_TICKS) if slowest > 0.0 else 1
    made = []
    for asked in frequencies_hz:
        ticks = _ticks(design, asked)
        frequency = 1.0 / (ticks * period)
        K = complex(stiffness_at(response, frequency)[0])
        moment = _DEFLECTION * twin.validation.full_deflection_rad * abs(K)
        if not np.isfinite(moment):
            K, moment = complex(np.inf), design.load.moment_max_Nm or 1.0
        made.append(Check(frequency, K, _injected(twin, moment, ticks, True, ceil(settle / ticks) + 1)))
    return tuple(made)


def stiffness_at_rest(design: Design, asked: Sequence[tuple[float, float]]) -> tuple[AtRest, ...]:
    """Fundamental stiffness of the drive as it is, command held, at (frequency in Hz, moment in N m)."""
    made = []
    for frequency, moment in asked:
        ticks = _ticks(design, frequency)
        K = _injected(design, moment, ticks, False)
        made.append(AtRest(moment, 1.0 / (ticks * design.controller.period_s), K))
    return tuple(made)


def _ticks(design: Design, frequency_hz: float) -> int:
    """Ticks of a period, a whole number of position periods."""
    every = design.controller.position.every if design.controller.position else 1
    return max(4, round(1.0 / (frequency_hz * design.controller.period_s * every))) * every


def _injected(design: Design, amplitude: float, ticks: int, linear: bool, skipped: int = SKIPPED) -> complex:
    """Stiffness seen at a moment of a period of so many ticks, after so many periods."""
    period, count = design.controller.period_s, (skipped + 2) * ticks
    turn = np.exp(-2j * np.pi * np.arange(ticks) / ticks)
    moment = np.tile(-amplitude * turn.imag, skipped + 2)
    run = simulate(
        design, commands.hold(), count * period, series(np.arange(count) * period, moment),
        friction_on=not linear, limits_on=not linear,
    )  # fmt: skip
    seen = run.output_angle_rad[skipped * ticks :].reshape(2, ticks) @ turn
    given = moment[skipped * ticks :].reshape(2, ticks) @ turn
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
