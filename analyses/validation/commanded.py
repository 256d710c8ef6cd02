"""The response to the command, as the drive has it: with feed-forward, filters and every loop closed.

The feedback loops are tested without feed-forward, which is no part of them; this is the other response.  The
command carries a faint sine, the drive stands without dry friction or, where it has a slope of its own about
rest, follows a ramp underneath.  The profile of the command is left out: a faint sine does not reach it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from analyses.validation.coherent import coherent
from analyses.validation.response import Sweep
from analyses.validation.transient import fourier_sum, long_enough
from nonlinear import Rows, Trajectory
from nonlinear.loop_setup import every, stages_of
from nonlinear.operating_motion import OperatingMotion, may_stand, operating_motion, standing

Floats = npt.NDArray[np.float64]
FAINT = 1e-3  # of full deflection, speed, current or voltage
STEADY = 1e-5  # relative change of the fundamental from one window to the next
FINE = 1e-6  # beyond it a point is waited for once more: a swinging transient shows little of itself
TRIES = 5
SMALL_ANGLE_RAD = 1e-3  # of the output, with gravity
BETWEEN = "between two ticks the speed reverses or the coupling comes free"
SIGNAL = {"position": "output_angle_rad", "velocity": "motor_speed_rad_s", "current": "current_A"}


def command_sweep(design: Design, frequency_hz: Floats, settle_ticks: int) -> Sweep:
    """Measure the response that `Loops.reference_to_output` predicts.

    Parameters
    ----------
    design : Design
        As on the bench, but with its command filter and feed-forward.
    frequency_hz : ndarray
        Below the Nyquist frequency of the outermost stage.
    settle_ticks : int
        Before the two windows.

    Returns
    -------
    Sweep
        ``closed_loop`` is the response: to the output angle of a position drive (output over output), to the
        motor's speed of a speed drive (per unit of the command), to the current of a torque drive, to the
        motor's speed of a voltage drive.
    """
    base = every(design, stages_of(design)[-1]) if stages_of(design) else 1
    window = coherent(frequency_hz, design.controller.period_s, base)
    motion = standing(design) if may_stand(design) else operating_motion(design)
    points = [
        _point(design, motion, int(ticks), float(hertz), base, settle_ticks)
        for ticks, hertz in zip(window.ticks, window.frequency_hz, strict=True)
    ]
    nothing = np.full(len(points), np.nan, complex)
    return Sweep(
        design_name=design.name,
        loop="command",
        point="command",
        period_s=base * design.controller.period_s,
        frequency_hz=window.frequency_hz,
        open_loop=nothing,
        closed_loop=np.array([nan if point.reason else point.response for point in points], complex),
        sensitivity=nothing,
        plant=nothing,
        amplitude=np.array([point.amplitude for point in points]),
        distortion=np.zeros(len(points)),
        unsteadiness=np.array([point.unsteadiness for point in points]),
        ticks=np.asarray(settle_ticks + 2 * window.ticks, dtype=float),
        reason=tuple(point.reason for point in points),
        speed_rad_s=motion.speed_rad_s,
    )


def command_step(design: Design, frequency_hz: Floats, slowest_ticks: float) -> Sweep | None:
    """The same from one long step of the command, for a drive that is slow against its tick.

    ``None`` where the step would take too long, or something not linear takes part in it.  See
    `analyses.validation.transient`; ``slowest_ticks`` is the slowest time constant.
    """
    base = every(design, stages_of(design)[-1]) if stages_of(design) else 1
    ticks = long_enough(slowest_ticks, base)
    if ticks is None:
        return None
    motion = standing(design) if may_stand(design) else operating_motion(design)
    size = FAINT * _full(design)
    values = []
    for part in (0.0, 0.5, 1.0):
        run = _run(design, motion, part * size, 0.0, ticks, base)
        if _why_not(design, motion, run, 0):
            return None
        values.append(np.asarray(getattr(run, _signal(design)), dtype=float))
    rest, half, whole = values
    commanded = size * (design.total_ratio if design.controller.outermost == "velocity" else 1.0)
    period_s = base * design.controller.period_s
    answers = [(y - rest) / (part * commanded) for y, part in ((whole, 1.0), (half, 0.5))]
    G, again = (fourier_sum(y, frequency_hz, period_s) for y in answers)
    left = float(np.ptp(answers[0][-max(rest.size // 10, 2) :]))
    nothing = np.full(G.size, np.nan, complex)
    return Sweep(
        design_name=design.name,
        loop="command",
        point="command",
        period_s=period_s,
        frequency_hz=frequency_hz,
        open_loop=nothing,
        closed_loop=G,
        sensitivity=nothing,
        plant=nothing,
        amplitude=np.full(G.size, size),
        distortion=np.zeros(G.size),
        unsteadiness=np.abs(G - again) / np.abs(G),
        ticks=np.full(G.size, float(ticks)),
        reason=("",) * G.size,
        speed_rad_s=motion.speed_rad_s,
        error=(np.abs(G - again).max() + left) / np.abs(G),
    )


def _signal(design: Design) -> str:
    return SIGNAL.get(design.controller.outermost, "motor_speed_rad_s")


@dataclass(frozen=True)
class _Point:
    """One frequency as measured."""

    amplitude: float
    response: complex
    unsteadiness: float
    reason: str


def _point(
    design: Design, motion: OperatingMotion, ticks: int, hertz: float, base: int, settle_ticks: int
) -> _Point:
    """Run one frequency, again with less amplitude or more time where it asks for it."""
    amplitude, waited = FAINT * _full(design), False
    for attempt in range(TRIES):
        run = _run(design, motion, amplitude, hertz, settle_ticks + 2 * ticks, base)
        point = _read(design, motion, run, amplitude, hertz, ticks // base)
        if not point.reason and motion.delicate:
            settled = _run(design, motion, amplitude, hertz, settle_ticks, base)
            point = replace(point, reason=BETWEEN if run.events > settled.events else "")
        hiding = not point.reason and not waited and point.unsteadiness > FINE
        if (not point.reason and not hiding) or attempt == TRIES - 1:
            break
        if hiding or point.reason == "not steady":
            settle_ticks, waited = 3 * settle_ticks, True
        else:
            amplitude *= 0.03
    return point


def _full(design: Design) -> float:
    """Size of the command: deflection, speed at the output, current, or voltage."""
    from analyses.validation.release import full_range

    stage = design.controller.outermost
    sizes = full_range(design)
    if stage == "velocity":
        return sizes["velocity"] / design.total_ratio
    return design.limits.voltage_V if stage == "voltage" else sizes[stage]


def _run(
    design: Design, motion: OperatingMotion, amplitude: float, hertz: float, ticks: int, base: int
) -> Trajectory:
    """The run, recorded at the instants of the outermost stage; a step instead of a sine of 0 Hz."""
    row = Rows.of(design, friction_on=motion.friction_on, limits_on=False)
    motion.load(row)
    row["twist_start"] = motion.twist_rad
    if not motion.speed_rad_s and motion.twist_rad and design.controller.position is not None:
        angle = design.ratio_to_coupling * motion.twist_rad  # the output stands at zero
        row["angle_start"] = angle
        if design.controller.position.sensor == "motor":
            row.step("bias", angle / design.total_ratio, -1.0)
    row["friction_feedforward"] = 0.0  # the sign of the command's motion: no part of a linear response
    row["ticks"], row["record_every"] = ticks, base
    if hertz > 0.0:
        row.sine("command", amplitude, hertz)
    else:
        row.step("command", amplitude)
    if motion.speed_rad_s:
        row["speed_start"], row["current_start"] = motion.speed_rad_s, motion.current_A
        row["load_speed_start"] = motion.speed_rad_s / design.ratio_to_coupling
        under = {"current": motion.current_A, "voltage": motion.voltage_V}
        bias = under.get(design.controller.outermost, motion.speed_rad_s / design.total_ratio)
        if design.controller.outermost == "position":
            row.ramp("bias", bias)
        else:
            row.step("bias", bias, -1.0)
    return row.trajectory()


def _read(
    design: Design, motion: OperatingMotion, run: Trajectory, amplitude: float, hertz: float, samples: int
) -> _Point:
    """Response over the last window of whole periods, and its change from the one before."""
    values = getattr(run, _signal(design))
    if design.controller.outermost == "position":
        values = values - motion.speed_rad_s / design.total_ratio * run.time_s
    turned = np.exp(-2j * np.pi * hertz * run.time_s)
    n = values.size
    last, before = (
        complex(2j / samples * np.sum(values[part] * turned[part]))
        for part in (slice(n - samples, n), slice(n - 2 * samples, n - samples))
    )
    change = abs(last - before) / max(abs(last), 1e-300)
    reason = _why_not(design, motion, run, n - samples) or ("" if change <= STEADY else "not steady")
    # a speed is commanded at the output, and predicted at the motor
    commanded = amplitude * (design.total_ratio if design.controller.outermost == "velocity" else 1.0)
    return _Point(amplitude, last / commanded, change, reason)


def _why_not(design: Design, motion: OperatingMotion, run: Trajectory, since: int) -> str:
    """What is not linear in a run from a record on; empty where nothing is."""
    acting = [name for name in run.limits if run.limit_active(name)[since:].any()]
    if run.status != "ok":
        return run.status
    if acting:
        return f"{acting[0]} limit"
    if motion.friction_on and run.motor_speed_rad_s[since:].min() <= 0.0:
        return "speed reversal"
    if np.abs(run.motor_speed_rad_s[since:] - motion.speed_rad_s).max() > motion.room_rad_s:
        return "friction has another slope there"
    if design.load.gravity is not None and np.ptp(run.output_angle_rad) > SMALL_ANGLE_RAD:
        return "gravity is not proportional to the angle"
    if motion.coupling_Nm and _parted(run, since):
        return "the coupling comes free"
    return ""


def _parted(run: Trajectory, since: int) -> bool:
    """Whether the coupling's torque changes its sign in the last window."""
    torque = run.coupling_torque_Nm
    return torque is not None and bool((torque[since:] <= 0.0).any())
