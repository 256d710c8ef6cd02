"""The response to the command, as the drive has it: with feed-forward, filters and every loop closed.

The feedback loops are tested without feed-forward, which is no part of them; this is the other response.  The
command carries a faint sine, the drive stands without dry friction or, where it has a slope of its own about
rest, follows a ramp underneath.  The profile of the command is left out: a faint sine does not reach it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from analyses.validation.bias_motion import BiasMotion, bias_motion, may_stand, standing
from analyses.validation.coherent import coherent
from analyses.validation.response import Sweep
from analyses.validation.rig import every, stages_of
from nonlinear import Rows, Trajectory

Floats = npt.NDArray[np.float64]
FAINT = 1e-3  # of full deflection, speed, current or voltage
STEADY = 1e-5  # relative change of the fundamental from one window to the next
FINE = 1e-6  # beyond it a point is waited for once more: a swinging transient shows little of itself
TRIES = 5
SMALL_ANGLE_RAD = 1e-3  # of the output, with gravity
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
    motion = standing(design) if may_stand(design) else bias_motion(design)
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


@dataclass(frozen=True)
class _Point:
    """One frequency as measured."""

    amplitude: float
    response: complex
    unsteadiness: float
    reason: str


def _point(
    design: Design, motion: BiasMotion, ticks: int, hertz: float, base: int, settle_ticks: int
) -> _Point:
    """Run one frequency, again with less amplitude or more time where it asks for it."""
    amplitude, waited = FAINT * _full(design), False
    for attempt in range(TRIES):
        run = _run(design, motion, amplitude, hertz, settle_ticks + 2 * ticks, base)
        point = _read(design, motion, run, amplitude, hertz, ticks // base)
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
    design: Design, motion: BiasMotion, amplitude: float, hertz: float, ticks: int, base: int
) -> Trajectory:
    """The run, recorded at the instants of the outermost stage."""
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
    row.sine("command", amplitude, hertz)
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
    design: Design, motion: BiasMotion, run: Trajectory, amplitude: float, hertz: float, samples: int
) -> _Point:
    """Response over the last window of whole periods, and its change from the one before."""
    values = getattr(run, SIGNAL.get(design.controller.outermost, "motor_speed_rad_s"))
    if design.controller.outermost == "position":
        values = values - motion.speed_rad_s / design.total_ratio * run.time_s
    turned = np.exp(-2j * np.pi * hertz * run.time_s)
    n = values.size
    last, before = (
        complex(2j / samples * np.sum(values[part] * turned[part]))
        for part in (slice(n - samples, n), slice(n - 2 * samples, n - samples))
    )
    change = abs(last - before) / max(abs(last), 1e-300)
    speed = run.motor_speed_rad_s[n - samples :]
    acting = [name for name in run.limits if run.limit_active(name)[n - samples :].any()]
    reason = "not steady" if not change <= STEADY else ""
    if run.status != "ok":
        reason = run.status
    elif acting:
        reason = f"{acting[0]} limit"
    elif motion.friction_on and speed.min() <= 0.0:
        reason = "speed reversal"
    elif design.load.gravity is not None and np.ptp(run.output_angle_rad) > SMALL_ANGLE_RAD:
        reason = "gravity is not proportional to the angle"
    elif motion.coupling_Nm and _parted(run, n - samples):
        reason = "the coupling comes free"
    # a speed is commanded at the output, and predicted at the motor
    commanded = amplitude * (design.total_ratio if design.controller.outermost == "velocity" else 1.0)
    return _Point(amplitude, last / commanded, change, reason)


def _parted(run: Trajectory, since: int) -> bool:
    """Whether the coupling's torque changes its sign in the last window."""
    torque = run.coupling_torque_Nm
    return torque is not None and bool((torque[since:] <= 0.0).any())
