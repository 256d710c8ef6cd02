"""A record: signals in SI over time, an account of every row of the file; made ready for an analysis."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import lru_cache
from itertools import chain, count
from typing import Any

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.types import Floats, Mask

DISORDER = "whose time does not increase"
SMOOTH, STRAIGHT, HELD = (
    f"{how} between samples" for how in ("smooth but for its steps", "in straight lines", "held")
)
RESAMPLE_TOLERANCE = 0.05  # of a signal's range: largest error of resampling accepted without being told to


@dataclass(kw_only=True)
class RowCounts:
    """Lines and rows of a file; once it is read ``rows_in == rows_out + sum(dropped.values())``."""

    lines: int = 0
    comments: int = 0
    blanks: int = 0
    header: int = 0
    rows_in: int = 0
    rows_out: int = 0
    dropped: dict[str, int] = field(default_factory=dict)
    first_dropped: dict[str, str] = field(default_factory=dict)  # where each reason was met first
    columns: tuple[str, ...] = field(default=(), repr=False)  # of the file
    first_stamp: datetime | None = field(default=None, repr=False)  # that its times count from

    def drop(self, reason: str, where: str, count: int = 1) -> None:
        """Count rows that are left out, and where the first of them was."""
        self.dropped[reason] = self.dropped.get(reason, 0) + count
        self.first_dropped.setdefault(reason, where)

    def __str__(self) -> str:
        parts = [f"{count} {why} (first: {self.first_dropped[why]})" for why, count in self.dropped.items()]
        text = f"{self.rows_in} rows in, {self.rows_out} out"
        return f"{text}; dropped: {', '.join(parts)}" if parts else text


@dataclass(frozen=True, kw_only=True)
class InputColumn:
    """One column of a file."""

    column: str
    signal: str = ""  # that it became; empty: none
    unit: str = ""  # that was read
    note: str = ""  # why it was left out, or what was done to it beside the conversion of its unit


@dataclass(frozen=True, kw_only=True)
class Record:
    """Signals of one run, one row a sample."""

    name: str
    time_s: Floats = field(repr=False)  # increases strictly and may be irregular
    signals: Mapping[str, Floats] = field(repr=False)  # arrays of the same length in SI
    units: Mapping[str, str]  # their SI units
    counts: RowCounts
    averaged: int = 1  # rows of a file too long to be held that were averaged into one
    sha256: str = ""
    constants: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    inputs: tuple[InputColumn, ...] = ()  # every column of the file
    resample_tolerance: float = RESAMPLE_TOLERANCE
    left_out: Mask | None = field(default=None, repr=False)  # rows that no fit is to use
    first_row: int = field(default=0, repr=False)  # rows of the file that come before the first
    as_read: Record | None = field(default=None, repr=False)  # before it was put on a grid; None: it is that
    # Keys of a design, with values that were other than the design's while this record was taken
    settings: Mapping[str, str | float] = field(default_factory=dict)
    # How the drive took its command between the rows: SMOOTH, STRAIGHT, HELD; empty: as it meets them best
    between: str = ""
    early_s: Floats | None = field(default=None, repr=False)  # a step of it came before each row; NaN: none

    def drive(self, design: Design) -> Design:
        """The design as it was set for this record."""
        if not self.settings:
            return design
        try:
            return _as_set(design, tuple(self.settings.items()))
        except InputError as error:
            raise InputError(f"settings: {error.message}", where=self.name) from None

    def __len__(self) -> int:
        return len(self.time_s)

    def __getitem__(self, name: str) -> Floats:
        """The named signal; an unknown name is an InputError that lists those there are."""
        if name in self.signals:
            return self.signals[name]
        raise InputError(f'no signal "{name}"; there are: {", ".join(self.signals)}', where=self.name)

    @property
    def period_s(self) -> float:
        """The median sampling period."""
        return float(np.median(np.diff(self.time_s)))

    @property
    def is_regular(self) -> bool:
        """Whether every period is within 1 % of the median."""
        steps = np.diff(self.time_s)
        return bool(np.all(np.abs(steps - np.median(steps)) <= 0.01 * np.median(steps)))

    @property
    def rows_missing(self) -> int | None:
        """Rows missing on a regular grid on which all others are; None where they are on none."""
        steps = np.diff(self.time_s) / self.period_s
        whole = np.round(steps)
        on_grid = np.all(np.abs(steps - whole) <= 0.01) and np.all(whole >= 1.0)
        return int(np.sum(whole - 1.0)) if on_grid else None

    def slice(self, start: int, stop: int) -> Record:
        """Rows ``start:stop``."""
        own: Any = {name: getattr(self, name) for name in ("time_s", "left_out", "early_s")}
        own = {name: rows if rows is None else rows[start:stop] for name, rows in own.items()}
        signals = {name: values[start:stop] for name, values in self.signals.items()}
        return replace(self, signals=signals, first_row=self.first_row + start, **own)

    def without(self, names: Collection[str]) -> Record:
        """The record without some signals."""
        return replace(self, signals={n: each for n, each in self.signals.items() if n not in names})

    def resampled(self) -> Record:
        """The record on a regular grid by linear interpolation, with the fact and its error noted.

        The error is estimated from the record itself: how far a straight line over as many samples as the
        longest gap holds is from the samples between (95 % of all places), a quarter of that for a grid
        that is only out of step. Above ``resample_tolerance`` of the range of a signal it is refused.
        """
        period, steps = self.period_s, np.diff(self.time_s)
        grid = np.arange(self.time_s[0], self.time_s[-1] + 1e-6 * period, period)
        cut = {name: np.interp(grid, self.time_s, values) for name, values in self.signals.items()}
        widest = int(np.argmax(steps))
        gap = float(steps[widest] / period)
        errors = ((line_error(self.time_s, values, gap), name) for name, values in self.signals.items())
        error, worst = max(errors, key=lambda one: one[0])
        lost = self.rows_missing
        note = f"{lost} rows missing on a regular grid: " if lost else ""
        note += f"resampled to a period of {period:.6g} s by linear interpolation; longest step "
        note += f"{steps[widest]:.4g} s at {self.time_s[widest]:.4g} s, error up to "
        note += f"{100.0 * error:.2g} % of the range ({worst})"
        check_error(error, self.resample_tolerance, note, self.name)
        return replace(self, time_s=grid, signals=cut, notes=(*self.notes, note), as_read=self)


@lru_cache(maxsize=64)
def _as_set(design: Design, settings: tuple[tuple[str, str | float], ...]) -> Design:
    """A fit asks the same thousands of times, and each time the design was read anew."""
    return design.with_values(dict(settings))


def check_error(error: float, tolerance: float, note: str, where: str) -> None:
    """Refuse what straight lines between samples would do to a signal."""
    if error > tolerance:
        allowed = f"allowed: {100.0 * tolerance:g} % (resample_tolerance of a record file); "
        allowed += "of a pause, a file for each part"
        raise InputError(f"{note}; {allowed}", where=where)


def line_error(time_s: Floats, values: Floats, gap: float) -> float:
    """How far straight lines over a gap are from a signal, as a share of its range (95 % point)."""
    span = max(2, round(gap))
    span_of_values = float(np.ptp(values))
    if len(values) <= span or span_of_values == 0.0:
        return 0.0 if span_of_values == 0.0 else 1.0
    half = span // 2
    share = (time_s[half : half + len(values) - span] - time_s[:-span]) / (time_s[span:] - time_s[:-span])
    line = values[:-span] + (values[span:] - values[:-span]) * share
    error = float(np.quantile(np.abs(values[half : half + len(line)] - line), 0.95)) / span_of_values
    return error if gap >= 1.5 else 0.25 * error


def named_apart(records: Sequence[Record], taken: Sequence[str] = ()) -> list[Record]:
    """Records with names of their own, where files of one name lie in several folders."""
    out: list[Record] = []
    for record in records:
        seen = {*taken, *(one.name for one in out)}
        others = (f"{record.name} ({k})" for k in count(2))
        name = next(name for name in chain([record.name], others) if name not in seen)
        out.append(replace(record, name=name))
    return out


def prepared(record: Record) -> Record:
    """A record on a regular grid, cut to its longest stretch with the drive enabled, both noted."""
    record = record if record.is_regular else record.resampled()
    if "enable" not in record.signals:
        return record
    start, stop = longest(record["enable"] > 0.5)
    if start == stop:
        raise InputError("the drive is never enabled", where=record.name)
    if stop - start == len(record):
        return record
    note = f"enabled from {record.time_s[start]:.4g} s to {record.time_s[stop - 1]:.4g} s: "
    note += f"{stop - start} of {len(record)} rows used"
    return replace(record.slice(start, stop), notes=(*record.notes, note))


def period_of(record: Record) -> float:
    """The period, rounded to a whole number of ns past the rounding of the record's times."""
    return float(round(float(np.mean(np.diff(record.time_s))) * 1e9) * 1e-9)


def stretches(marked: Mask) -> list[tuple[int, int]]:
    """Where marked rows follow each other: the first, and the one after the last.

    >>> stretches(np.array([True, False, False, True, True]))
    [(0, 1), (3, 5)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], marked.astype(np.int8), [0]]))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def longest(marked: Mask) -> tuple[int, int]:
    """The longest such stretch, the first of equal ones; an empty one where nothing is marked."""
    return max(stretches(marked), key=lambda one: one[1] - one[0], default=(0, 0))


def lasting(marked: Mask, least: int) -> Mask:
    """Marked rows, but for those of stretches shorter than ``least``."""
    out = np.zeros(len(marked), dtype=bool)
    for start, stop in stretches(marked):
        out[start:stop] = stop - start >= least
    return out
