"""Frequency response by injection, the way it is measured on a bench (stepped sine).

A sine is added at the break point; in front of the instrument the loop answers ``before = -L after``, so one
run gives the open loop ``-before/after``, the closed loop ``-before/injected``, the sensitivity
``after/injected`` and the plant ``measured/after``.  The fundamentals come from correlation over whole
periods that fill whole ticks (of the slowest loop), so there is no leakage.  The drive moves at a constant
speed, where dry friction is a constant torque; amplitudes are chosen so that no limit acts and the speed
keeps its sign, and both are checked.
"""

from __future__ import annotations

from math import ceil, inf, log
from typing import Any

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.validation.budget import OutOfTime
from analyses.validation.coherent import Coherent, coherent, hold_factor
from analyses.validation.response import Sweep
from nonlinear import LIMITERS
from nonlinear.loop_setup import LoopSetup, loop_setup
from nonlinear.reduced import BatchResult

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]

STEADY = 1e-5  # relative change of the fundamental from one window to the next (rule H3)
ARRIVED = 1e-4  # of the injected sine: so much of it may be missing behind the instrument
USED_ROOM = 0.3  # of the way to the nearest limit, or to standstill, that the amplitude takes
SETTLE_TIME_CONSTANTS = 14.0
LONGEST_SETTLE_TICKS = 100_000  # at first; a point that is not steady then is given more
LONGEST_EXTENDED_TICKS = 1_600_000
EVER_TICKS = 10**9  # no run is so long: this tells how slow a loop is
SMALL_ANGLE_RAD = 1e-3  # sin x is x to 2e-7 in the fundamental
FAINT_SETTLE_TICKS = 2_000
EXTENSIONS, LONGER = 3, 4
PLANT_SIGNAL = {"u": "current_A", "i_ref": "motor_speed_rad_s", "w_ref": "motor_speed_rad_s"}


def frequency_response(
    design: Design,
    loop: str,
    frequency_hz: npt.ArrayLike,
    *,
    settle_s: float | None = None,
    threads: int | None = None,
) -> Sweep:
    """Measure a loop by stepped sine.

    Parameters
    ----------
    design : Design
    loop : str
        ``"current"``, ``"velocity"``, ``"position"`` (inner loops closed, outer ones out of action), or a
        break point ``"u"``, ``"i_ref"``, ``"w_ref"``, ``"output"`` (all other loops closed).
    frequency_hz : array_like
        Asked for; each is moved to the next that fits (`analyses.validation.coherent`).
    settle_s : float, optional
        Wait before the two windows; by default from the closed loop's slowest pole. A point that is not
        steady by rule H3 is measured again with four times the wait, up to three times.

    Raises
    ------
    InputError
        For an unknown loop, a frequency that is not below Nyquist, or a drive that has no bias motion.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> sweep = frequency_response(load_design("ilr33-amber"), "position", [5.0, 20.0], settle_s=0.15)
    >>> sweep.reason
    ('', '')
    """
    setup = loop_setup(design, loop)
    asked = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    nyquist = 0.5 / setup.period_s
    if not asked.size or not (np.isfinite(asked) & (asked > 0.0) & (asked < nyquist)).all():
        raise InputError(f"frequency_hz: positive and below the Nyquist frequency of {nyquist:g} Hz")
    wait = settling_ticks(setup) if settle_s is None else ceil(settle_s / design.controller.period_s)
    return stepped_sine(setup, asked, wait, threads)


def stepped_sine(
    setup: LoopSetup,
    frequency_hz: Floats,
    settle_ticks: int,
    threads: int | None = None,
    amplitude: Floats | None = None,
    window: Coherent | None = None,
) -> Sweep:
    """Measure at a rig that has been set up; see `frequency_response`.

    ``amplitude`` (injected, peak) is what to begin with; by default a faint run says what fits.  ``window``
    takes the place of the shortest windows that fit.
    """
    if window is None:
        window = coherent(frequency_hz, setup.design.controller.period_s, setup.base_ticks)
    if amplitude is None:
        amplitude = fitting_amplitude(setup, window, settle_ticks, threads)
    result = _run(setup, window, amplitude, settle_ticks, threads)
    for _ in range(EXTENSIONS):
        reasons = _reasons(setup, result, window, amplitude)
        poor = np.flatnonzero([bool(text) for text in reasons])
        if not poor.size:
            break
        limited = np.array([reasons[k] != "not steady" for k in poor])
        amplitude[poor[limited]] *= 0.4
        longer = min(LONGER * settle_ticks, LONGEST_EXTENDED_TICKS)
        if longer <= settle_ticks and not limited.any():
            break  # the same run again would show the same
        settle_ticks = max(longer, settle_ticks)
        part = window.part(poor)
        try:
            again = _run(setup, part, amplitude[poor], settle_ticks, threads)
        except OutOfTime:
            break  # what could be measured stands; the others say why not
        result = result.with_part(poor, again)
    return _sweep(setup, window, amplitude, result)


def settling_ticks(setup: LoopSetup) -> int:
    """Ticks until the slowest mode of the closed loop has died out, by its pole.

    Raises
    ------
    InputError
        If the loop is not stable: nothing settles.
    """
    from actuator_lti.loops import assemble_loops

    loops = assemble_loops(setup.design)
    loop = loops.present[setup.loop] if setup.loop in loops.present else loops.break_points[setup.loop]
    return settling_ticks_of(loop.closed_loop, setup.hold_ticks, setup.design.name)


def settling_ticks_of(
    closed_loop: Any, hold_ticks: int, where: str, longest: int = LONGEST_SETTLE_TICKS
) -> int:
    """Ticks after which the slowest pole of a sampled closed loop is forgotten."""
    size = np.abs(closed_loop.poles())
    if (size > 1.0 + 1e-9).any():
        raise InputError("the loop is not stable: nothing can be measured on it", where=where)
    slowest = size[size < 1.0 - 1e-9].max(initial=0.0)
    if slowest <= 0.0:
        return 20 * hold_ticks
    samples = SETTLE_TIME_CONSTANTS / -log(slowest)
    return int(min(ceil(samples + 20.0) * hold_ticks, longest))


def fitting_amplitude(
    setup: LoopSetup, window: Coherent, settle_ticks: int, threads: int | None = None
) -> Floats:
    """Injected amplitudes that keep clear of limits and of standstill, from a faint run first."""
    rooms = {name: room for name, room in setup.room.items() if room < inf}
    smallest = {"u": "voltage_V", "i_ref": "current_command_A", "w_ref": "speed_command_rad_s"}
    scale = rooms.get(smallest.get(setup.point, ""), 1.0)
    if setup.point == "output":
        scale = rooms.get("motor_speed_rad_s", 1.0) / (
            setup.design.total_ratio * setup.design.controller.position_loop.gain
        )
    faint = np.full(window.ticks.size, 1e-4 * scale)
    result = _run(setup, window, faint, min(settle_ticks, FAINT_SETTLE_TICKS), threads)
    most = np.full(faint.size, inf)
    if setup.point in smallest:
        rooms[setup.before] = rooms.get(smallest[setup.point], inf)
    for name, room in rooms.items():
        low, high = result.span(name)
        moved = np.maximum(high - result.mean(name), result.mean(name) - low)
        most = np.minimum(most, room * faint / np.maximum(moved, 1e-300))
    most = np.minimum(most, _acceleration_room(setup, window, result, faint))
    most = np.minimum(most, _contact_room(setup, window, result, faint))
    most = np.minimum(most, _gravity_room(setup, result, faint))
    return np.where(np.isfinite(most), USED_ROOM * most, faint)


def _acceleration_room(setup: LoopSetup, window: Coherent, result: BatchResult, faint: Floats) -> Floats:
    """Amplitude at which the speed command would change by the acceleration limit in one update."""
    limit, controller = setup.design.limits.acceleration_rad_s2, setup.design.controller
    if setup.outer != "position" or controller.velocity is None or not np.isfinite(limit):
        return np.full(faint.size, inf)
    T = controller.position_loop.every * controller.period_s
    signal = "probe_w_ref_before" if setup.point == "w_ref" else "speed_command_rad_s"
    low, high = result.span(signal)
    change = (high - low) * np.abs(np.sin(np.pi * window.frequency_hz * T))
    return limit * T * faint / np.maximum(change, 1e-300)


def _contact_room(setup: LoopSetup, window: Coherent, result: BatchResult, faint: Floats) -> Floats:
    """Amplitude at which the coupling's torque would change its sign, by what moves the load."""
    design = setup.design
    if setup.bias.coupling_Nm == 0.0:
        return np.full(faint.size, inf)
    friction, omega = design.load.friction, 2.0 * np.pi * window.frequency_hz
    viscous = 0.0 if friction is None else friction.viscous_Nms_rad
    moved = np.abs(phasor(setup, result, "output_angle_rad")) * design.ratio_behind_coupling * omega
    swing = moved * np.abs(1j * omega * design.load_side_inertia_kgm2 + viscous)
    return abs(setup.bias.coupling_Nm) * faint / np.maximum(swing, 1e-300)


def _gravity_room(setup: LoopSetup, result: BatchResult, faint: Floats) -> Floats:
    """Amplitude at which gravity is no longer proportional to the angle."""
    if setup.design.load.gravity is None:
        return np.full(faint.size, inf)
    return SMALL_ANGLE_RAD * faint / np.maximum(np.abs(phasor(setup, result, "output_angle_rad")), 1e-300)


def _run(
    setup: LoopSetup, window: Coherent, amplitude: Floats, settle_ticks: int, threads: int | None
) -> BatchResult:
    """Run one row a frequency."""
    rows = setup.row().repeat(window.ticks.size)
    rows["ticks"] = settle_ticks + 2 * window.ticks
    rows.window(window.ticks, window.cycles)
    rows.sine(setup.point, amplitude, window.frequency_hz)
    return rows.run(threads=threads)


def _reasons(setup: LoopSetup, result: BatchResult, window: Coherent, amplitude: Floats) -> list[str]:
    """Why a point cannot be reported, or nothing."""
    tick_s = setup.design.controller.period_s
    injected = amplitude * hold_factor(window.frequency_hz, tick_s, setup.hold_ticks)
    arrived = phasor(setup, result, setup.after) - phasor(setup, result, setup.before)
    lost = np.abs(arrived - injected) > ARRIVED * np.abs(injected)
    reasons = [""] * result.status.size
    steady = unsteadiness(setup, result) <= STEADY
    for k in range(len(reasons)):
        acting = [name for name in LIMITERS if result.window_limit_fraction(name)[k] > 0.0]
        if not result.ok[k]:
            reasons[k] = "run stopped"
        elif acting:
            reasons[k] = f"{acting[0]} limit"
        elif result.events[k] and setup.bias.delicate:
            reasons[k] = "speed reversal"
        elif not steady[k]:
            reasons[k] = "not steady"
        elif lost[k]:
            reasons[k] = "injection cut off by a limit"
    return reasons


def unsteadiness(setup: LoopSetup, result: BatchResult) -> Floats:
    """Change between the last two windows, the larger of both sides of the instrument."""
    change = np.zeros(result.status.size)
    for signal in (setup.before, setup.after):
        a, b = (phasor(setup, result, signal, last) for last in (0, 1))
        change = np.maximum(change, np.abs(a - b) / np.maximum(np.abs(a), 1e-300))
    return change


def phasor(setup: LoopSetup, result: BatchResult, signal: str, last: int = 0) -> Complexes:
    """Fundamental of a signal, freed from the ramp of the bias motion where it is an angle."""
    phasors = result.phasor(signal, 1, last)
    if "output" not in signal and "reference" not in signal:
        return phasors
    from analyses.validation.coherent import ramp_phasor

    ticks, length = result.column("ticks"), result.column("window")
    window = Coherent(phasors.real, length.astype(np.int64), result.column("cycles").astype(np.int64))
    slope = setup.bias.speed_rad_s / setup.design.total_ratio * setup.design.controller.period_s
    return phasors - ramp_phasor(slope, window, ticks - (last + 1) * length)


def _sweep(setup: LoopSetup, window: Coherent, amplitude: Floats, result: BatchResult) -> Sweep:
    """Make the responses from the fundamentals."""
    tick, f = setup.design.controller.period_s, window.frequency_hz
    held = hold_factor(f, tick, setup.hold_ticks)
    before, after = (phasor(setup, result, signal) for signal in (setup.before, setup.after))
    injected = amplitude * held
    reasons = _reasons(setup, result, window, amplitude)
    good = np.where([not text for text in reasons], 1.0, np.nan)
    plant = PLANT_SIGNAL.get(setup.point, "motor_speed_rad_s")
    if setup.point == "u" and "current" not in setup.stages:
        plant = "motor_speed_rad_s"
    return Sweep(
        design_name=setup.design.name,
        loop=setup.loop,
        point=setup.point,
        period_s=setup.period_s,
        frequency_hz=f,
        open_loop=-before / after * good,
        closed_loop=-before / injected * good,
        sensitivity=after / injected * good,
        plant=phasor(setup, result, plant) / after * good,
        amplitude=amplitude,
        distortion=_distortion(setup, result, held),
        unsteadiness=unsteadiness(setup, result),
        ticks=result.column("ticks"),
        reason=tuple(reasons),
        speed_rad_s=setup.bias.speed_rad_s,
    )


def _distortion(setup: LoopSetup, result: BatchResult, held: Complexes) -> Floats:
    """What is neither mean nor fundamental in front of the instrument (at the output: in the speed)."""
    angle = setup.point == "output"
    signal, factor = ("motor_speed_rad_s", 1.0) if angle else (setup.before, np.abs(held))
    power = result.rms(signal) ** 2 - result.mean(signal) ** 2
    alone = 0.5 * np.abs(result.phasor(signal) / factor) ** 2
    other = alone if angle else 0.5 * np.abs(result.phasor(setup.after) / factor) ** 2
    return np.sqrt(np.maximum(power - alone, 0.0) / np.maximum(np.maximum(alone, other), 1e-300))
