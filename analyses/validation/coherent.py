"""Frequencies of which a whole number of periods fills whole ticks, and what a held signal does to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]
LEAST_SAMPLES = 400


@dataclass(frozen=True)
class Coherent:
    """Test frequencies with their windows.

    Attributes
    ----------
    frequency_hz : ndarray, shape (K,)
        ``cycles/(ticks Ts)`` exactly, at most half a sample over the window off the one asked for.
    ticks, cycles : ndarray of int, shape (K,)
        Window length in ticks, a multiple of the slowest loop's period; whole periods in it.
    """

    frequency_hz: Floats
    ticks: npt.NDArray[np.int64]
    cycles: npt.NDArray[np.int64]

    def part(self, which: npt.NDArray[np.int64]) -> Coherent:
        """Some of them."""
        return Coherent(self.frequency_hz[which], self.ticks[which], self.cycles[which])


def coherent(
    frequency_hz: npt.ArrayLike,
    tick_s: float,
    base_ticks: int = 1,
    least_cycles: int = 1,
    least_samples: npt.ArrayLike = LEAST_SAMPLES,
) -> Coherent:
    """Move frequencies to the nearest ones that can be measured without leakage.

    Parameters
    ----------
    frequency_hz : array_like
        Positive, below half of ``1/(base_ticks tick_s)`` at the slowest loop.
    tick_s : float
    base_ticks : int
        Ticks after which everything in the drive repeats.
    least_samples : int or array_like of int
        Of the slowest loop in a window: frequencies that can be measured lie one over it apart.

    Examples
    --------
    >>> result = coherent([333.0, 2.0], 1e-4, base_ticks=2)
    >>> result.ticks.tolist(), result.cycles.tolist()
    ([810, 5000], [27, 1])
    """
    asked = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    period = base_ticks * tick_s
    cycles = np.maximum(least_cycles, np.ceil(np.asarray(least_samples) * asked * period)).astype(np.int64)
    samples = np.rint(cycles / (asked * period)).astype(np.int64)
    return Coherent(cycles / (samples * period), samples * base_ticks, cycles)


def hold_factor(frequency_hz: npt.ArrayLike, tick_s: float, hold_ticks: int) -> Complexes:
    """Fundamental of a sine sampled every ``hold_ticks`` ticks and held between, seen at every tick.

    Examples
    --------
    >>> bool(abs(hold_factor(100.0, 1e-4, 1)[0] - 1.0) < 1e-15)
    True
    """
    turn = 2.0 * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=float)) * tick_s
    return np.exp(-1j * np.outer(turn, np.arange(hold_ticks))).mean(axis=1)


def ramp_phasor(slope_per_tick: npt.ArrayLike, window: Coherent, start_tick: npt.ArrayLike) -> Complexes:
    """What a ramp leaves in a correlation over whole periods, as `BatchResult.phasor` defines phasors."""
    step = 2.0 * np.pi * window.cycles / window.ticks
    total = window.ticks / (np.exp(-1j * step) - 1.0)  # sum of k exp(-j step k)
    turned = np.exp(-1j * step * np.asarray(start_tick))
    return 2j / window.ticks * np.asarray(slope_per_tick) * total * turned
