"""Rows that no drive can have taken, each by its line, time and value; noise and counts of a signal."""

import numpy as np
from scipy.special import ndtr, ndtri

from actuator_lti.types import Floats, Ints
from analyses.records.record import Record

MOST_NAMED = 3
NORMAL = 1.4826  # standard deviation of a normal spread over its median
ROUNDING = 1e-6  # of a position in a file
OFF_COUNT = 0.05  # of a count


def noise_bound(values: Floats, sure: float) -> float:
    """What white noise of a signal, known from row to row, reaches in no row, as sure as so many deviations.

    Second differences of white noise have six times its variance; the median passes over single bad rows.

    >>> noise = np.random.default_rng(1).standard_normal(10_000)
    >>> bool(np.max(np.abs(noise)) < noise_bound(noise, 4.0) < 7.0)
    True
    """
    std = NORMAL * float(np.median(np.abs(np.diff(values, 2)))) / np.sqrt(6.0) if len(values) > 2 else 0.0
    return std * -float(ndtri(ndtr(-sure) / len(values)))


def count_of(values: Floats) -> float:
    """The count of the encoder that a position was read from, where all of it is at such; else 0.

    >>> count_of(np.array([0.0, 0.25, 0.5, 1.0])), count_of(np.array([0.0, 0.25, 0.6]))
    (0.25, 0.0)
    """
    levels = np.unique(values)
    steps = np.diff(levels)
    steps = steps[steps > ROUNDING * np.max(np.abs(levels))]  # of the file
    if not len(steps):
        return 0.0
    count = float(np.mean(steps[steps < 1.5 * np.min(steps)]))
    many = np.round(steps / count)
    whole = np.all(np.abs(steps / count - many) <= OFF_COUNT)
    return float(np.sum(steps) / np.sum(many)) if whole else 0.0


def impossible_steps(record: Record, place: Floats, rate: float, sure: float) -> Ints:
    """The row behind each step of a position that is larger than a rate, a count and noise make it."""
    step = np.abs(np.diff(place))
    count = np.min(step, where=step > 0.0, initial=np.inf)
    most = rate * np.diff(record.time_s) + np.sqrt(2.0) * noise_bound(place, sure)
    return np.flatnonzero(step > most + (count if np.isfinite(count) else 0.0)) + 1


def named_rows(record: Record, rows: Ints, name: str, unit: str, *, jumps: bool = False) -> str:
    """The first few such rows, with what the file has there in SI; with ``jumps`` the row before as well."""
    values = record[name]

    def words(row: int) -> str:
        before = f"from {values[row - 1]:.4g} to " * jumps
        return f"{before}{values[row]:.4g} {unit} in {place_in_file(record, row)}"

    more = [f"{len(rows) - MOST_NAMED} more"] if len(rows) > MOST_NAMED else []
    return " and ".join([", ".join(map(words, rows[:MOST_NAMED].tolist())), *more])


def place_in_file(record: Record, row: int) -> str:
    """The line of a row where every line of the file is one, else which row it is; and its time."""
    counts, number = record.counts, record.first_row + row + 1
    plain = counts.lines == counts.header + counts.rows_out and record.averaged == 1
    where = f"line {counts.header + number}" if counts.lines and plain else f"row {number}"
    return f"{where} ({record.time_s[row]:.6g} s)"
