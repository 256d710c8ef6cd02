"""Sines at many amplitudes and frequencies, simulated until settled, reduced to harmonics and limiter use."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from actuator_lti.design.model import Design
from analyses.large_signal.classify import STEADY
from analyses.large_signal.grid import Tone
from analyses.large_signal.steady_start import LinearSteadyState, triangle_start
from nonlinear import Rows
from nonlinear.runs.reduced import BatchResult

Progress = Callable[[int, int], None]
HARMONICS = 3
BEYOND = 1.1  # of the amplitude of the linear start: only what is limited can end in a triangle
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
    rows = Rows.of(design, len(which), friction_on=friction_on)
    windows = np.array([t.ticks for t in tones])[which]
    cycles = np.array([t.cycles for t in tones])[which]
    rows.sine("command", amplitude_rad, np.array([t.frequency_hz for t in tones])[which])
    rows.window(windows, cycles, harmonics)
    start.put(rows, which, start_amplitude_rad)
    triangle_start(design, rows, amplitude_rad, amplitude_rad > BEYOND * start_amplitude_rad)
    rows["load"] = load_Nm
    rows["ticks"] = start.settling_ticks + 2 * windows
    result = rows.run(progress=progress)
    return _again(rows, result, start.settling_ticks) if insist else result


def _again(rows: Rows, result: BatchResult, settling_ticks: int) -> BatchResult:
    """Repeat the runs that are not steady with a longer start-up."""
    moving = result.window_stick_fraction < 1.0
    late = np.flatnonzero(result.ok & moving & (result.unsteadiness("output_angle_rad") > STEADY))
    if not len(late):
        return result
    longer = rows.take(late)
    longer["ticks"] += LONGER * settling_ticks + np.ceil(
        np.minimum(MORE_WINDOWS * longer["window"], MORE_TICKS)
    )
    return result.with_part(late, longer.run())
