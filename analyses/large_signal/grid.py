"""Which amplitudes and frequencies are looked at, and windows that every phase of the sampling occurs in."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.loops import Loops
from analyses.large_signal.steady_start import linear_steady_state
from analyses.linear.responses import response_at

LEAST_UPDATES = 96  # updates of the position loop in a window: peaks are seen to 1 - cos(pi/96) = 0.05 %
DECADES_BELOW, FACTOR_ABOVE = 1.6, 8.0
HIGHEST = 0.8  # of the Nyquist frequency of the position loop
MOST_TICKS = 4_000_000  # of a map, its repetitions apart; where more work is needed the grid is coarser
FRICTION_RANGE, PLAIN_RANGE, LARGEST_RANGE = 2.0, 200.0, 2e4


@dataclass(frozen=True)
class Tone:
    """A frequency of which whole periods fill a window of ticks, at as many phases as it has updates."""

    frequency_hz: float
    ticks: int
    cycles: int

    @property
    def omega_rad_s(self) -> float:
        """Angular frequency."""
        return 2.0 * math.pi * self.frequency_hz


def tone(
    frequency_hz: float, design: Design, least_updates: int = LEAST_UPDATES, least_cycles: int = 1
) -> Tone:
    """Choose the tone next to a frequency; off by less than one update over the window.

    Updates and periods of a window have no common factor, so that a sampled sinusoid is seen at as many
    phases as there are updates: its largest sample is its peak to ``1 - cos(pi/updates)``.
    """
    control = design.controller
    every = control.position_loop.every
    T = every * control.period_s
    cycles = max(least_cycles, math.ceil(least_updates * frequency_hz * T))
    updates = round(cycles / (frequency_hz * T))
    while math.gcd(cycles, updates) > 1:
        updates += 1
    return Tone(cycles / (updates * T), updates * every, cycles)


def frequency_range_hz(design: Design, loops: Loops) -> tuple[float, float]:
    """Give the range around the bandwidth of the position loop in which large signals are looked at."""
    T = design.controller.position_loop.every * design.controller.period_s
    nyquist = 0.5 / T
    grid = np.geomspace(nyquist * 1e-5, nyquist * 0.999, 400)
    magnitude = np.abs(response_at(loops.plain_response, 2.0 * np.pi * grid))
    below = np.flatnonzero(magnitude < math.sqrt(0.5))
    bandwidth = float(grid[below[0]]) if below.size else nyquist
    high = min(bandwidth * FACTOR_ABOVE, HIGHEST * nyquist)
    return bandwidth / 10.0**DECADES_BELOW, high


def tones(design: Design, loops: Loops, count: int) -> tuple[Tone, ...]:
    """Give tones, spread evenly on a logarithmic scale around the bandwidth."""
    low, high = frequency_range_hz(design, loops)
    return tuple(tone(float(f), design) for f in np.geomspace(low, high, count))


def work_ticks(design: Design, loops: Loops, count: int) -> int:
    """Ticks that one sine at each of so many tones takes, until it has settled and in two windows.

    A tick of smoothed friction, which is integrated in steps, counts as three.
    """
    settling = linear_steady_state(loops, np.array([1.0])).settling_ticks
    each = 3 if design.friction.law == "tanh" else 1
    return each * sum(settling + 2 * tone.ticks for tone in tones(design, loops, count))


def amplitudes(design: Design, count: int, smallest_rad: float | None) -> np.ndarray:
    """Give command amplitudes up to full deflection, among them those that the design asks for.

    Parameters
    ----------
    smallest_rad : float or None
        Command that just overcomes dry friction at once (`analyses.linear.static_threshold`); the range
        begins at twice that, within 1/20000 to 1/200 of full deflection.
    """
    full = design.validation.full_deflection_rad
    wanted = sorted({fraction * full for fraction in design.validation.amplitude_fractions})
    top = max(full, wanted[-1])
    low = full / PLAIN_RANGE
    if smallest_rad is not None and math.isfinite(smallest_rad):
        low = float(np.clip(FRICTION_RANGE * smallest_rad, full / LARGEST_RANGE, low))
    values = np.geomspace(min(low, 0.5 * wanted[0]), top, max(count, 2))
    free = np.ones(len(values), dtype=bool)
    for amplitude in wanted:
        distance = np.where(free, np.abs(np.log(values / amplitude)), np.inf)
        nearest = int(np.argmin(distance))
        values[nearest], free[nearest] = amplitude, False
    return np.sort(values)
