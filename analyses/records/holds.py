"""When a command that is held jumps: on a grid of its own, told by the rows that show it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import minimize_scalar

from actuator_lti.types import Floats, Ints
from analyses.records.finding import NO_CHANCE, RATE_TOLERANCE

FINER = 8  # lines of the spectrum for each that the record resolves
ROUNDING = 1e-9  # of a row
ON_TICKS = 1e-3  # of a tick: rows stay so close to the ticks over the whole record
OPEN = 1e-5  # of a tick: a jump is not at the row before it


@dataclass(frozen=True, kw_only=True)
class Hold:
    """Jumps at ``first + n period``: every so many ticks of the drive, which the rows see at any phase."""

    ticks: int  # from one instant to the next
    tick_s: float  # by the record's clock
    row_s: float
    rows: Ints  # the first behind each jump that they show
    numbers: Ints  # n of each
    earliest_s: float  # the first jump, behind the first row
    latest_s: float
    is_whole: bool  # whether a row is a whole number of ticks

    def early_s(self, first_s: float) -> Floats:
        """By how much each jump comes before its row, by when the first one does."""
        return np.asarray(self.row_s * self.rows - first_s - self.numbers * self.ticks * self.tick_s)

    def first_s(self, early_s: Floats) -> float:
        """When the first jump comes, by how much each is before its row."""
        return float(self.row_s * self.rows[0] - early_s[0])

    @property
    def room_s(self) -> float:
        """How far a jump may be off the grid, as the rows see all of them."""
        return self.latest_s - self.earliest_s

    def holds(self, early_s: Floats) -> bool:
        """Whether all jumps are on the grid, by how much each is before its row."""
        off = early_s - self.early_s(self.first_s(early_s))
        return bool(np.all(np.abs(off) < ON_TICKS * self.tick_s))

    def ahead_s(self, early_s: Floats) -> float:
        """How long before the first row the drive has its first tick: all jumps are at one."""
        ticks = -self.first_s(early_s) / self.tick_s
        return float(self.tick_s * (ticks - np.floor(ticks + ON_TICKS)))

    @property
    def likely_s(self) -> Floats:
        """`early_s` of the middle of where the first jump may be; of whole rows at a tick."""
        middle = 0.5 * (self.earliest_s + self.latest_s)
        if self.is_whole:
            middle = self.tick_s * np.floor(self.latest_s / self.tick_s + ON_TICKS)
        return self.early_s(middle)

    def more_s(self, early_s: Floats) -> tuple[float, float]:
        """By how much less and more early the jumps may be, where no row is to see another of them.

        With whole ticks off, where they were moved by such.
        """
        first = self.first_s(early_s)
        least, most = first - self.latest_s, first - self.earliest_s
        moved = 0.0 if least <= 0.0 <= most else self.tick_s * np.round(0.5 * (least + most) / self.tick_s)
        return least - moved, most - moved - OPEN * self.tick_s

    def more_ticks(self, early_s: Floats) -> tuple[float, float]:
        """The same in whole ticks."""
        least, most = self.more_s(early_s)
        return float(np.ceil(least / self.tick_s - ON_TICKS)), float(np.floor(most / self.tick_s + ON_TICKS))


def hold_of(rows: Ints, count: int, row_s: float, tick_s: float) -> Hold | None:
    """The longest hold of whole ticks with which each jump lies between its row and the one before.

    ``rows``: the first row behind each jump, of ``count`` rows. The tick may be off as a clock may be. None
    where every row shows a jump, or where chance would place so many on one of the grids that were tried.

    >>> jumps = np.arange(1, 400)
    >>> hold = hold_of(np.ceil(2.5 * jumps - 0.7).astype(int), 1000, 2e-4, 1e-4)
    >>> hold.ticks, hold.tick_s, round(hold.earliest_s, 7), round(hold.latest_s, 7)
    (5, 0.0001, 0.0003, 0.0004)
    """
    return _hold_of(tuple(rows.tolist()), count, float(row_s), float(tick_s))


@lru_cache(maxsize=64)
def _hold_of(jumps: tuple[int, ...], count: int, row_s: float, tick_s: float) -> Hold | None:
    first, tick = np.array(jumps, dtype=np.int64), tick_s / row_s
    if len(first) < 3 or first[-1] - first[0] == len(first) - 1:
        return None
    rows = first - first[0]
    longest = min(np.diff(rows).min() + 1.0, (rows[-1] + 1.0) / (len(rows) - 1))  # no hold has two jumps
    most = int(longest / (tick * (1.0 - RATE_TOLERANCE)))
    line = np.abs(np.fft.rfft(np.bincount(rows, minlength=FINER * int(rows[-1]))))
    tried = np.log(max(most, 1) * float(rows[-1]) / NO_CHANCE)
    for ticks in range(most, 0, -1):
        of_each, chance = np.log(max(ticks * tick, 1.0)), -1.0 if 1 == ticks < tick else tried  # at a tick
        if (len(rows) - 2) * of_each <= chance or (found := _grid(rows, line, ticks * tick)) is None:
            continue
        period, numbers = found
        if _not_foretold(numbers) * of_each <= chance:
            continue
        whole = max(round(period / tick), 1)
        if _room(rows, numbers, whole * tick) > ROUNDING:
            period = whole * tick
        latest = first - numbers * period
        return Hold(
            ticks=whole,
            tick_s=period / whole * row_s,
            row_s=row_s,
            rows=first,
            numbers=numbers,
            earliest_s=row_s * (float(latest.max()) - 1.0),
            latest_s=row_s * float(latest.min()),
            is_whole=abs(whole / period - round(whole / period)) * count < ON_TICKS,
        )
    return None


def _not_foretold(numbers: Ints) -> int:
    """How many jumps the two before them do not foretell, as they do those of a square wave.

    >>> _not_foretold(np.array([0, 7, 16, 25, 34])), _not_foretold(np.arange(5))
    (1, 3)
    """
    gaps = np.diff(numbers)
    return int(np.count_nonzero((gaps[1:] != gaps[:-1]) | (gaps[1:] == 1)))


def _grid(rows: Ints, line: Floats, nominal: float) -> tuple[float, Ints] | None:
    """The period (rows) and numbers of a grid that the jumps may be on: the nominal one, or off by a clock.

    ``line`` is the spectrum of the jumps: on a grid all their phases are within a row, which gives them a
    line at its frequency, of at least ``cos(pi/period)`` of their number.
    """

    def turned(rate: float) -> complex:
        return complex(np.sum(np.exp(2j * np.pi * rate * rows)))

    def numbered(rate: float) -> Ints:
        numbers = np.round(rate * rows - np.angle(turned(rate)) / (2.0 * np.pi)).astype(np.int64)
        return np.asarray(numbers - numbers[0])

    if _room(rows, numbers := numbered(1.0 / nominal), nominal) > ROUNDING:
        return nominal, numbers
    size = FINER * int(rows[-1])
    low, high = (size / nominal / (1.0 + side * RATE_TOLERANCE) for side in (1, -1))
    bins = np.arange(int(low), min(int(high) + 2, size))
    heights = line[np.minimum(bins, size - bins)]
    least = np.cos(np.pi / max(nominal * (1.0 - RATE_TOLERANCE), 1.0)) * np.sinc(0.5 / FINER)
    if not heights.max(initial=0.0) > max(least, 0.0) * len(rows):
        return None
    top = float(bins[int(np.argmax(heights))])
    near = {"bounds": ((top - 1.0) / size, (top + 1.0) / size), "method": "bounded"}
    peak = minimize_scalar(lambda rate: -abs(turned(rate)), options={"xatol": 1e-4 / size}, **near)
    numbers = numbered(float(peak.x))
    widest = minimize_scalar(
        lambda rate: -_room(rows, numbers, 1.0 / rate), options={"xatol": ROUNDING / size}, **near
    )
    return (1.0 / float(widest.x), numbers) if -widest.fun > ROUNDING else None


def _room(rows: Ints, numbers: Ints, period: float) -> float:
    """Rows between which the first jump may be: each is after the row before its own, and not after that."""
    latest = rows - numbers * period
    return float(latest.min() - latest.max()) + 1.0
