"""The time of each row: a column of seconds, of ticks that may wrap, or a constant period."""

from __future__ import annotations

import numpy as np

from actuator_lti.errors import InputError
from analyses.estimation.arrays import BoolArray, FloatArray, IntArray
from analyses.records.csv_rows import Account, Block
from analyses.records.spec import RecordSpec
from analyses.records.units import unit_factor


class TimeAxis:
    """Turns blocks of raw rows into time and values, dropping and counting what the spec says.

    The order: rows with a missing value, rows below the stated minimum of the raw time, wrap-around undone,
    rows whose time does not increase.
    """

    def __init__(self, spec: RecordSpec, account: Account, origin: str) -> None:
        self._spec, self._account, self._origin = spec, account, origin
        time = spec.time
        self._factor = time.tick_s or unit_factor(time.unit, "s", "time")
        self._row = 0
        self._wraps = 0.0
        self._last_raw: float | None = None
        self._last_time = -np.inf

    def apply(self, block: Block) -> tuple[FloatArray, FloatArray]:
        """Time in s, shape (n,), and the values of the signals, shape (n, signals)."""
        values, lines = self._without_missing(block.values, block.lines)
        if self._spec.time.period_s is not None:
            time = np.asarray((self._row + np.arange(len(values))) * self._spec.time.period_s)
            self._row += len(values)
            return time, values
        if self._spec.time.minimum is not None:
            keep = np.asarray(values[:, 0] >= self._spec.time.minimum)
            reason = f"time below {self._spec.time.minimum:g}"
            values, lines = self._keep(keep, values, lines, reason)
        time = self._unwrapped(values[:, 0]) * self._factor
        return self._increasing(time, values[:, 1:], lines)

    def _without_missing(self, values: FloatArray, lines: IntArray) -> tuple[FloatArray, IntArray]:
        looked_at = values
        if self._spec.missing == "interpolate":  # the signals are filled later, the time is not
            looked_at = values[:, : 0 if self._spec.time.period_s is not None else 1]
        missing: BoolArray = np.asarray(np.isnan(looked_at).any(axis=1))
        if missing.any() and self._spec.missing == "error":
            raise InputError("a value is missing", where=f"{self._origin}:{lines[missing.argmax()]}")
        return self._keep(~missing, values, lines, "with a missing value")

    def _keep(
        self, keep: BoolArray, values: FloatArray, lines: IntArray, reason: str
    ) -> tuple[FloatArray, IntArray]:
        if keep.all():
            return values, lines
        first = int(lines[np.argmin(keep)])
        self._account.drop(reason, f"line {first}", int(np.count_nonzero(~keep)))
        return values[keep], lines[keep]

    def _unwrapped(self, raw: FloatArray) -> FloatArray:
        wrap = self._spec.time.wrap
        if wrap is None or not len(raw):
            return raw
        before = raw[0] if self._last_raw is None else self._last_raw
        jumps = np.diff(raw, prepend=before) < -0.5 * wrap
        unwrapped: FloatArray = raw + self._wraps + wrap * np.cumsum(jumps)
        self._wraps += wrap * int(np.count_nonzero(jumps))
        self._last_raw = float(raw[-1])
        return unwrapped

    def _increasing(
        self, time: FloatArray, values: FloatArray, lines: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        if not len(time):
            return time, values
        reached = np.maximum.accumulate(np.concatenate([[self._last_time], time]))
        keep = time > reached[:-1]
        if not keep.all():
            k = int(np.argmin(keep))
            if self._spec.disorder == "error":
                message = f'time {time[k]:.9g} s does not come after {reached[k]:.9g} s (see "disorder")'
                raise InputError(message, where=f"{self._origin}:{lines[k]}")
            self._account.drop(
                "whose time does not increase", f"line {lines[k]}", int(np.count_nonzero(~keep))
            )
        self._last_time = float(reached[-1])
        return time[keep], values[keep]
