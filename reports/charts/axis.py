"""An axis: from values to a place between 0 and 1, and the ticks that a reader can name.

Tick labels are whole numbers to be read alone: no offset and no common factor beside the axis.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from reports.numbers import plain_decade, short

MARGIN = 0.05


@dataclass(kw_only=True)
class Axis:
    """One axis of a panel; limits that are not set follow the values drawn."""

    log: bool = False
    days: bool = False  # values are days since 1970: read out as a date
    label: str = ""
    low: float | None = None
    high: float | None = None
    ticks: Sequence[tuple[float, str]] | None = None
    grid: bool = True
    name: str = ""
    reversed: bool = False
    seen: list[float] = field(default_factory=list)

    def limits(self, low: float | None = None, high: float | None = None) -> None:
        self.low = self.low if low is None else float(low)
        self.high = self.high if high is None else float(high)

    def see(self, values: Sequence[float] | np.ndarray) -> None:
        """Let the limits take these values in, where they are not set."""
        array = np.asarray(values, dtype=float)
        array = array[np.isfinite(array)]
        for each in (array, array[array > 0.0]):  # whether the axis is logarithmic may be said later
            self.seen += [float(each.min()), float(each.max())] if len(each) else []

    def shown(self) -> list[float]:
        """Give the least and the largest value seen that the axis, as it is now, has a place for."""
        seen = [value for value in self.seen if value > 0.0 or not self.log]
        return [min(seen), max(seen)] if seen else []

    def written(self) -> Axis:
        return replace(self, seen=self.shown())

    def span(self) -> tuple[float, float]:
        """Give both ends: those set, or the values with some room."""
        low, high = self.shown() or (1.0 if self.log else 0.0, 1.0)
        if self.log:
            room = (high / low) ** MARGIN if high > low else 2.0
            ends = (low / room, high * room)
        else:
            room = MARGIN * (high - low) or max(0.05 * abs(high), 1e-9)
            ends = (low - room, high + room)
        first = ends[0] if self.low is None else self.low
        last = ends[1] if self.high is None else self.high
        if not last > first:
            last = first * 2.0 if self.log else first + max(abs(first), 1.0)
        return first, last

    def place(self, values: Sequence[float] | np.ndarray) -> np.ndarray:
        """Give the places of values, 0 at the low end and 1 at the high one; NaN where there is none."""
        low, high = self.span()
        array = np.asarray(values, dtype=float)
        result = (array - low) / (high - low)
        if self.log:
            with np.errstate(divide="ignore", invalid="ignore"):
                result = np.log(array / low) / math.log(high / low)
            result = np.where(array > 0.0, result, np.where(array <= 0.0, -1e3, np.nan))
        return np.asarray(1.0 - result if self.reversed else result)

    def named_ticks(self, room: int = 6) -> list[tuple[float, str]]:
        low, high = self.span()
        if self.ticks is not None:
            slack = 1e-9 * (high - low)
            return [(v, words) for v, words in self.ticks if low - slack <= v <= high + slack]
        return log_ticks(low, high, room) if self.log else linear_ticks(low, high, room)


def linear_ticks(low: float, high: float, room: int = 6) -> list[tuple[float, str]]:
    """Give ticks at multiples of 1, 2, 2.5 or 5 times a power of ten.

    >>> [words for _, words in linear_ticks(0.0, 1.0)]
    ['0', '0.2', '0.4', '0.6', '0.8', '1']
    >>> [words for _, words in linear_ticks(19.66001, 19.66009, 4)]
    ['19.66002', '19.66004', '19.66006', '19.66008']
    """
    rough = (high - low) / max(room, 1)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(f * power for f in (1.0, 2.0, 2.5, 5.0, 10.0) if f * power >= rough * (1.0 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [(k * step, short(k * step, 12)) for k in range(first, last + 1)]


def log_ticks(low: float, high: float, room: int = 6) -> list[tuple[float, str]]:
    """Give ticks at decades, or at 1, 2 and 5 times a decade where there are few.

    >>> [words for _, words in log_ticks(0.3, 5000.0)]
    ['1', '10', '100', '1k']
    >>> [words for _, words in log_ticks(3.0, 60.0)]
    ['5', '10', '20', '50']
    """
    decades = math.log10(high / low)
    if decades < 0.7:
        return [(v, words) for v, words in linear_ticks(low, high, max(room - 1, 3)) if v > 0.0]
    every = max(1, math.ceil(decades / max(room, 1)))
    mantissas = (1.0,) if decades > 2.2 else (1.0, 2.0, 5.0)
    first, last = math.floor(math.log10(low) - 1e-9), math.ceil(math.log10(high) + 1e-9)
    values = [m * 10.0**k for k in range(first, last + 1) if k % every == 0 for m in mantissas]
    return [(v, plain_decade(v)) for v in values if low * (1 - 1e-9) <= v <= high * (1 + 1e-9)]


def minor_ticks(axis: Axis) -> list[float]:
    low, high = axis.span()
    if not axis.log or axis.ticks is not None or math.log10(high / low) > 5.5:
        return []
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    return [m * 10.0**k for k in powers for m in range(2, 10) if low < m * 10.0**k < high]
