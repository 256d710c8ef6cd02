"""Frequency response by multisine: all frequencies at once, repeated periods, coherence beside it."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.validation.sweep import settling_ticks, stepped_sine
from nonlinear.loop_setup import STAGES, LoopSetup, loop_setup

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]
PERIODS = 4
CROWD = 1.5  # sum of the lines' shares of the amplitude that a single sine may have


@dataclass(frozen=True)
class ToneSweep:
    """A frequency response measured with all tones together.

    Attributes
    ----------
    frequency_hz : ndarray, shape (K,)
    open_loop, closed_loop : ndarray of complex, shape (K,)
    coherence : ndarray, shape (K,)
        Squared, over the repeated periods; 1: the answer is entirely due to the tone.
    unsteadiness : float
        Largest change of a tone between the last two periods, relative to the largest tone.
    peak : float
        Of the injected signal, in the unit of the point.
    reason : str
        Why it cannot be trusted: a limit, a reversal; else empty.
    """

    frequency_hz: Floats
    open_loop: Complexes
    closed_loop: Complexes
    coherence: Floats
    unsteadiness: float
    peak: float
    reason: str


def multisine_response(design: Design, loop: str, frequency_hz: npt.ArrayLike, *, seed: int = 0) -> ToneSweep:
    """Measure a loop (inner loops closed, outer ones open) with all frequencies at once.

    Frequencies are moved to whole multiples of the lowest one; those that fall together are measured once.
    Phases are random from ``seed``; amplitudes are those that a sine of each frequency may have, shared.

    Raises
    ------
    InputError
        For a break point with all loops closed (its images in a multirate loop would fall onto other tones),
        or frequencies that are not below Nyquist.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> result = multisine_response(load_design("ilr33-amber"), "velocity", [20.0, 60.0, 300.0])
    >>> bool(result.coherence.min() > 0.999)
    True
    """
    if loop not in STAGES:
        raise InputError(f"loop = {loop!r}: one of {', '.join(STAGES)}")
    setup = loop_setup(design, loop)
    asked = np.sort(np.atleast_1d(np.asarray(frequency_hz, dtype=float)))
    if not asked.size or asked[0] <= 0.0 or asked[-1] >= 0.5 / setup.period_s:
        raise InputError(f"frequency_hz: positive and below {0.5 / setup.period_s:g} Hz (Nyquist)")
    settle = settling_ticks(setup)
    single = stepped_sine(setup, asked, settle)
    return tone_sweep(setup, asked, single.amplitude, settle, seed)


def tone_sweep(
    setup: LoopSetup, frequency_hz: Floats, amplitude: Floats, settle_ticks: int, seed: int = 0
) -> ToneSweep:
    """Measure at a rig, sharing the amplitudes that a sine of each (sorted) frequency may have."""
    samples = max(round(1.0 / (frequency_hz[0] * setup.period_s)), 2)
    lines = np.unique(np.rint(frequency_hz * samples * setup.period_s).astype(int))
    lines = lines[(lines > 0) & (2 * lines < samples)]
    allowed = np.interp(np.log(lines / (samples * setup.period_s)), np.log(frequency_hz), amplitude)
    return _measure(setup, lines, samples, CROWD * allowed / lines.size, settle_ticks, seed)


def _measure(
    setup: LoopSetup, lines: np.ndarray, samples: int, amplitude: Floats, settle_ticks: int, seed: int
) -> ToneSweep:
    """One run: settle, then whole periods; tones by the discrete Fourier transform of each period."""
    n = setup.hold_ticks
    settle = ceil(settle_ticks / (n * samples)) * samples
    signal = _signal(lines, samples, amplitude, seed)
    total = settle + PERIODS * samples
    table = np.repeat(np.tile(signal, total // samples), n)
    row = setup.row()
    row["ticks"] = table.size
    row.series(setup.point, table)
    run = row.trajectory()
    record = run.probes[setup.point]
    before, after, injected = (
        np.fft.rfft(x[::n][settle:].reshape(PERIODS, samples), axis=1)[:, lines] * 2.0 / samples
        for x in (record.before, record.after, table)
    )
    cross = (before * after.conj()).sum(axis=0)
    power_after, power_before = (np.abs(x**2).sum(axis=0) for x in (after, before))
    change = np.abs(before[-1] - before[-2]).max() / np.abs(before[-1]).max()
    limited = next((f"{name} limit" for name, use in run.limits.items() if use.active), "")
    reversal = "speed reversal" if run.events and setup.bias.friction_on else ""
    return ToneSweep(
        frequency_hz=lines / (samples * setup.period_s),
        open_loop=-cross / power_after,
        closed_loop=-(before * injected.conj()).sum(axis=0) / (np.abs(injected) ** 2).sum(axis=0),
        coherence=np.abs(cross) ** 2 / (power_after * power_before),
        unsteadiness=float(change),
        peak=float(np.abs(signal).max()),
        reason=limited or reversal,
    )


def _signal(lines: np.ndarray, samples: int, amplitude: Floats, seed: int) -> Floats:
    """One period of the tones with random phases."""
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, lines.size)
    turns = 2.0 * np.pi * np.outer(lines, np.arange(samples)) / samples
    return np.asarray(amplitude @ np.sin(turns + phases[:, None]), dtype=float)
