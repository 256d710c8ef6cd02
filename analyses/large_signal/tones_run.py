"""Sines at many amplitudes and frequencies, simulated until settled, reduced to harmonics and limiter use."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from actuator_lti.design.model import Design
from analyses.large_signal.classify import STEADY
from analyses.large_signal.grid import Tone
from analyses.large_signal.steady_start import LinearSteadyState, triangle_start
from nonlinear import Rows
from nonlinear.runs.reduced import BatchResult
from nonlinear.runs.running import Running

HARMONICS = 3
BEYOND = 1.1  # of the amplitude of the linear start: only what is limited can end in a triangle
LONGER, MORE_WINDOWS, MORE_TICKS = 4, 12, 24_000
TANH_TOLERANCE = 1e-5  # of the smoothing speed, a tick: far below what a fundamental is looked at for


def run_tones(
    design: Design,
    tones: tuple[Tone, ...],
    which: np.ndarray,
    amplitude_rad: np.ndarray,
    start: LinearSteadyState,
    start_amplitude_rad: np.ndarray,
    *,
    load_Nm: float = 0.0,
    friction_on: bool = True,
    harmonics: int = HARMONICS,
    insist: bool = False,
) -> BatchResult:
    """Simulate one sine a run, tone ``which[r]``, from the linear steady state at ``start_amplitude_rad``.

    That is at most the onset of limiting; both amplitudes are the command's, at the output shaft.  ``insist``
    goes on with what has not settled, for four times the start-up and several periods more.
    """
    rows = Rows.of(design, len(which), friction_on=friction_on)
    windows = np.array([t.ticks for t in tones])[which]
    cycles = np.array([t.cycles for t in tones])[which]
    rows.sine("command", amplitude_rad, np.array([t.frequency_hz for t in tones])[which])
    rows.window(windows, cycles, harmonics)
    start.put(rows, which, start_amplitude_rad)
    triangle_start(design, rows, amplitude_rad, amplitude_rad > BEYOND * start_amplitude_rad)
    rows["load"], rows["tanh_tolerance"] = load_Nm, TANH_TOLERANCE
    rows["ticks"] = start.settling_ticks + 2 * windows
    if not insist:
        return rows.run()
    drives = [rows.running(k) for k in range(len(rows))]
    return _gone_on(rows, drives, rows.run(drives=drives), start.settling_ticks)


def _gone_on(rows: Rows, drives: Sequence[Running], result: BatchResult, settling_ticks: int) -> BatchResult:
    """Go on with the runs that are not steady."""
    moving = result.window_stick_fraction < 1.0
    late = np.flatnonzero(result.ok & moving & (result.unsteadiness("output_angle_rad") > STEADY))
    if not len(late):
        return result
    longer = rows.take(late)
    longer["ticks"] += LONGER * settling_ticks + np.ceil(
        np.minimum(MORE_WINDOWS * longer["window"], MORE_TICKS)
    )
    return result.with_part(late, longer.run(drives=[drives[int(k)] for k in late]))
