"""Margins, bandwidths and step figures of many designs at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import inf, pi

import numpy as np

from actuator_lti.batch.parameters import OperatingPoint, Population
from actuator_lti.errors import InputError

LOOP_NAMES = ("current", "velocity", "position")
QUANTITIES = (
    "gain_margin",
    "phase_margin",
    "delay_margin",
    "modulus_margin",
    "sensitivity_peak",
    "bandwidth",
    "bandwidth_90deg",
    "resonance_peak",
    "rise_time",
    "overshoot",
    "settling_time",
)
"""Names of requirements.toml quantities that have one value a loop; units in `UNITS`."""
UNITS = {
    "gain_margin": "dB",
    "phase_margin": "deg",
    "delay_margin": "s",
    "modulus_margin": "1",
    "sensitivity_peak": "dB",
    "bandwidth": "Hz",
    "bandwidth_90deg": "Hz",
    "resonance_peak": "dB",
    "rise_time": "s",
    "overshoot": "%",
    "settling_time": "s",
}
_TIME = ("rise_time", "overshoot", "settling_time")
_CHUNK = 64
_MOST_ORDER = 80


@dataclass(frozen=True)
class Crossovers:
    """Crossovers of one loop of many designs, in order of frequency; NaN past the last one.

    Attributes
    ----------
    frequency_rad_s, margin : ndarray, shape (count, 6)
        Margin in deg (gain crossovers) or as ratio (phase crossovers).
    found : ndarray of int, shape (count,)
        How many there are; where it is more than 6 the rest is not listed.
    """

    frequency_rad_s: np.ndarray
    margin: np.ndarray
    found: np.ndarray


@dataclass(frozen=True)
class LinearFigures:
    """Figures of the sampled loops of many designs.

    Definitions are those of `actuator_lti.stability_margins`, `actuator_lti.bandwidth` and
    `actuator_lti.step`. A design whose loop is unstable keeps its crossovers; its closed-loop figures
    are NaN, its delay margin is 0.
    Closed-loop figures of the position loop are from command to output, feed-forward included.

    Attributes
    ----------
    loops : tuple of str
        The loops that the structure has.
    count : int
    raw : ndarray, shape (count, 3, columns)
        What the compiled code wrote (see ``_figures``); angles are radians per sample.
    period_s : ndarray, shape (count, 3)
        Sampling period of each loop.
    """

    loops: tuple[str, ...]
    count: int
    raw: np.ndarray
    period_s: np.ndarray

    def stable(self, loop: str) -> np.ndarray:
        """Whether the closed loop is stable, bool, shape (count,)."""
        return self._column(loop, 0) == 1.0

    def pole_radius(self, loop: str) -> np.ndarray:
        """Largest modulus of a closed-loop pole, shape (count,)."""
        return self._column(loop, 14).copy()

    def gain_crossovers(self, loop: str) -> Crossovers:
        """Frequencies where |L| = 1, with phase margins in deg."""
        from ._figures import FIRST_GAIN

        found = self._list(loop, FIRST_GAIN, 1)
        return Crossovers(found.frequency_rad_s, np.degrees(found.margin), found.found)

    def phase_crossovers(self, loop: str) -> Crossovers:
        """Frequencies where L is negative real, with gain margins as ratio."""
        from ._figures import FIRST_PHASE

        return self._list(loop, FIRST_PHASE, 2)

    def quantity(self, name: str, loop: str) -> np.ndarray:
        """One figure of one loop, shape (count,), in the unit of `UNITS`.

        Margins are the ones to quote; ``inf`` where there is none.
        """
        if name not in QUANTITIES:
            raise InputError(f"quantity {name!r}: one of {', '.join(QUANTITIES)}")
        return getattr(self, f"_{name}")(loop)

    def _index(self, loop: str) -> int:
        if loop not in self.loops:
            raise InputError(f"loop {loop!r}: this design has {', '.join(self.loops)}")
        return LOOP_NAMES.index(loop)

    def _column(self, loop: str, column: int) -> np.ndarray:
        return self.raw[:, self._index(loop), column]

    def _period(self, loop: str) -> np.ndarray:
        return self.period_s[:, self._index(loop)]

    def _list(self, loop: str, first: int, counter: int) -> Crossovers:
        from ._figures import LISTED

        block = self.raw[:, self._index(loop), first : first + 2 * LISTED]
        angles, margins = block[:, 0::2], block[:, 1::2]
        order = np.argsort(angles, axis=1, kind="stable")
        return Crossovers(
            np.take_along_axis(angles, order, 1) / self._period(loop)[:, None],
            np.take_along_axis(margins, order, 1),
            self._column(loop, counter).astype(int),
        )

    def _where_stable(self, loop: str, values: np.ndarray) -> np.ndarray:
        return np.where(self.stable(loop), values, np.nan)

    def _gain_margin(self, loop: str) -> np.ndarray:
        db = 20.0 * np.log10(self.phase_crossovers(loop).margin)
        return _nearest_zero(db)

    def _phase_margin(self, loop: str) -> np.ndarray:
        return _nearest_zero(self.gain_crossovers(loop).margin)

    def _delay_margin(self, loop: str) -> np.ndarray:
        found = self.gain_crossovers(loop)
        angle = np.radians(np.where(found.margin > 0, found.margin, found.margin + 360.0))
        delays = np.where(np.isnan(angle), inf, angle / found.frequency_rad_s)
        return np.where(self.stable(loop), delays.min(axis=1), 0.0)

    def _modulus_margin(self, loop: str) -> np.ndarray:
        return self._column(loop, 3).copy()

    def _sensitivity_peak(self, loop: str) -> np.ndarray:
        return -20.0 * np.log10(self._modulus_margin(loop))

    def _resonance_peak(self, loop: str) -> np.ndarray:
        ratio = self._column(loop, 5) / np.abs(self._column(loop, 9))
        return self._where_stable(loop, np.maximum(20.0 * np.log10(ratio), 0.0))

    def _bandwidth(self, loop: str) -> np.ndarray:
        return self._where_stable(loop, self._column(loop, 7) / self._period(loop) / (2 * pi))

    def _bandwidth_90deg(self, loop: str) -> np.ndarray:
        return self._where_stable(loop, self._column(loop, 8) / self._period(loop) / (2 * pi))

    def _rise_time(self, loop: str) -> np.ndarray:
        return self._where_stable(loop, self._column(loop, 10) * self._period(loop))

    def _overshoot(self, loop: str) -> np.ndarray:
        return self._where_stable(loop, self._column(loop, 11))

    def _settling_time(self, loop: str) -> np.ndarray:
        return self._where_stable(loop, self._column(loop, 12) * self._period(loop))


def _nearest_zero(values: np.ndarray) -> np.ndarray:
    """Of each row the value nearest to zero, inf where there is none."""
    size = np.where(np.isnan(values), inf, np.abs(values))
    best = np.argmin(size, axis=1)
    rows = np.arange(len(values))
    return np.where(np.isinf(size[rows, best]), inf, values[rows, best])


def linear_figures(
    population: Population,
    *,
    operating_point: OperatingPoint = "sliding",
    load_Nm: float = 0.0,
    speed_amplitude_rad_s: float | None = None,
    direction: int = 1,
    time_figures: bool = True,
    threads: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> LinearFigures:
    """Figures of the sampled loops of every design of a population.

    The same sampled loops as `actuator_lti.assemble_loops` (form ``"sampled"``) and the same definitions
    as `actuator_lti.stability_margins`, compiled: each design is assembled in closed form, its response
    followed on a grid that is refined until nothing can hide between two points, every crossover
    polished to rounding. The bits do not depend on threads or on the rest of the population.

    Parameters
    ----------
    population : Population
    operating_point, load_Nm, speed_amplitude_rad_s, direction
        As in `actuator_lti.assemble_loops`.
    time_figures : bool
        Whether to follow the step responses as well (most of the time).
    threads : int
        Threads that share the designs.
    progress : callable, optional
        Called with (designs done, designs in all).

    Raises
    ------
    InputError
        For a computing delay of so many ticks that the order passes 80.
    """
    from ._figures import COLUMNS
    from ._run import many_designs

    rows = population.rows(operating_point, load_Nm, speed_amplitude_rad_s, direction)
    kind = population.structure()
    size = population.largest_order(rows, kind)
    if size > _MOST_ORDER:
        raise InputError(f"control.computing_delay: gives loops of order {size}; at most {_MOST_ORDER} here")
    out = np.empty((population.count, 3, COLUMNS))
    starts: Sequence[int] = range(0, population.count, _CHUNK)

    def fill(first: int) -> int:
        last = min(first + _CHUNK, population.count)
        many_designs(kind, rows, first, last, size, time_figures, out)
        return last - first

    done = 0
    with ThreadPoolExecutor(max(1, threads)) as pool:
        for finished in pool.map(fill, starts):
            done += finished
            if progress is not None:
                progress(done, population.count)
    names = tuple(n for n, there in zip(LOOP_NAMES, (kind[1], kind[2], 1), strict=True) if there)
    ticks = np.array([1, kind[3], kind[4]], dtype=float)
    return LinearFigures(names, population.count, out, rows[:, 7:8] * ticks)
