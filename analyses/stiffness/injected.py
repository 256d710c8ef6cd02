"""The stiffness put to the simulator: a moment injected at the output while the command stands still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, log

import numpy as np

from actuator_lti.design.model import Design, Instruments
from actuator_lti.errors import InputError, UnstableError
from actuator_lti.loops.compliance import compliance
from actuator_lti.loops.stiffness import lost_motion_rad, stiffness_at
from analyses.stiffness.result import AtRest, Check, LostMotion
from nonlinear import commands, simulate
from nonlinear.loads import series

_SETTLED = 1e-7
_MOST_TICKS = 400_000
SKIPPED = 6  # periods at rest, before one is looked at
LOST_MOTION_S = 2.0
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
    over whole periods is exact once the transient is gone.

    Raises
    ------
    InputError
        For a drive whose output does not answer a moment.
    """
    twin, period = linear_twin(design), design.controller.period_s
    response = compliance(twin)
    if not response.moves:
        raise InputError("stiffness: the output of this drive does not answer a moment")
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
    """Lost motion of a coupling, 2 (b + C0_l/k) / N_r; None for a rigid drive train."""
    if design.coupling is None:
        return None
    play = design.coupling.play_rad / design.ratio_behind_coupling
    return LostMotion(play, lost_motion_rad(design), lost_motion_seen(design) if seen else None)


def lost_motion_seen(design: Design) -> float:
    """Lost motion in the simulator: a slow moment to either side and back, the motor's sensor holding.

    Its peak is three times the load's dry friction (twice is enough), or a hundredth of the largest moment.
    """
    coupling, friction = design.coupling, design.load.friction
    if coupling is None or design.controller.position is None:
        raise InputError("stiffness: lost motion needs a coupling and a position loop")
    dry = (friction.dry_torque_Nm if friction else 0.0) * design.ratio_behind_coupling
    moment_Nm = max(3.0 * dry, 0.01 * design.load.moment_max_Nm)
    position = replace(design.controller.position, sensor="motor")
    held = replace(
        design,
        controller=replace(design.controller, position=position),
        load=design.load.bare(),
    )
    quarter = LOST_MOTION_S / 5.0
    times = quarter * np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    moments = moment_Nm * np.array([0.0, 1.0, 0.0, -1.0, 0.0, 0.0])
    run = simulate(held, commands.hold(), LOST_MOTION_S, series(times, moments))
    at = [int(k * quarter / design.controller.period_s) for k in (2, 4)]
    twist_out = run.output_angle_rad - run.motor_angle_rad / design.total_ratio
    return float(twist_out[at[0]] - twist_out[at[1]])
