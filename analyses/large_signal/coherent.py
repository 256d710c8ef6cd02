"""Frequencies of which a whole number of periods fills whole ticks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
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
