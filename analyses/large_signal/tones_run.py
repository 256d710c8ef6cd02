"""Sines at many amplitudes and frequencies, simulated until settled, reduced to harmonics and limiter use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from actuator_lti.design.model import Design
from analyses.large_signal.classify import STEADY
from analyses.large_signal.grid import Tone
from analyses.large_signal.steady_start import LinearSteadyState, triangle_start
from nonlinear._kernels import layout as at
from nonlinear.batch import put_sine, put_window, repeat_row, run_rows
from nonlinear.parameters import design_row
from nonlinear.reduced import BatchResult

Progress = Callable[[int, int], None]
HARMONICS = 3
LONGER, MORE_WINDOWS, MORE_TICKS = 4, 12, 24_000


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
    progress: Progress | None = None,
) -> BatchResult:
    """Simulate one sine a run from its linear steady state.

    Parameters
    ----------
    which : ndarray of int, shape (n,)
        Tone of each run.
    amplitude_rad : ndarray, shape (n,)
        Command amplitude at the output shaft.
    start_amplitude_rad : ndarray, shape (n,)
        Amplitude of the linear state that the run starts from (at most the onset of limiting).
    insist : bool
        Repeat what has not settled, with a start-up four times as long and several periods more.
    """
    rows = repeat_row(design_row(design, friction_on=friction_on), len(which))
    windows = np.array([t.ticks for t in tones])[which]
    cycles = np.array([t.cycles for t in tones])[which]
    put_sine(rows, at.COMMAND, amplitude_rad, np.array([t.frequency_hz for t in tones])[which])
    put_window(rows, windows, cycles, harmonics)
    start.put(rows, which, start_amplitude_rad)
    triangle_start(design, rows, amplitude_rad)
    rows[:, at.LOAD] = load_Nm
    rows[:, at.TICKS] = start.settling_ticks + 2 * windows
    result = run_rows(rows, progress=progress)
    return _again(result, start.settling_ticks) if insist else result


def _again(result: BatchResult, settling_ticks: int) -> BatchResult:
    """Repeat the runs that are not steady with a longer start-up."""
    moving = result.window_stick_fraction < 1.0
    late = np.flatnonzero(result.ok & moving & (result.unsteadiness("output_angle_rad") > STEADY))
    if not len(late):
        return result
    rows, outs, status = result.rows.copy(), result.outs.copy(), result.status.copy()
    more = np.minimum(MORE_WINDOWS * rows[late, at.WINDOW], MORE_TICKS)
    rows[late, at.TICKS] += LONGER * settling_ticks + np.ceil(more)
    repeated = run_rows(rows[late])
    outs[late], status[late] = repeated.outs, repeated.status
    return replace(result, rows=rows, outs=outs, status=status)
