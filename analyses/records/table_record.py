"""Records out of named columns of numbers: the time of each row, missing values, SI."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown_path
from analyses.estimation.arrays import BoolArray, FloatArray, IntArray
from analyses.records.csv_rows import Account, Block
from analyses.records.inputs import inputs_of
from analyses.records.record import Record, RowCounts, line_error
from analyses.records.spec import RecordSpec, converter, unit_factor


def filled(
    time_s: FloatArray, signals: Mapping[str, FloatArray], tolerance: float, where: str
) -> tuple[dict[str, FloatArray], tuple[str, ...]]:
    """Signals without holes, linear between the values that there are; outside them the nearest is held.

    The notes tell what was filled, and the error of a straight line over one step of the values that there
    are, which may be ``tolerance`` of the signal's range.
    """
    whole, notes = {}, []
    for name, values in signals.items():
        there = ~np.isnan(values)
        if there.all():
            whole[name] = values
            continue
        if np.count_nonzero(there) < 3:
            raise InputError(f"{name}: {np.count_nonzero(there)} values, three wanted", where=where)
        error = 0.25 * line_error(time_s[there], values[there], 2.0)
        gaps = int(np.count_nonzero(~there))
        note = (
            f"{name}: {gaps} of {len(values)} values missing, linear between the others, "
            f"error up to {100.0 * error:.2g} % of the range"
        )
        if error > tolerance:
            allowed = f"allowed: {100.0 * tolerance:g} % (resample_tolerance of a record file)"
            raise InputError(f"{note}; {allowed}", where=where)
        whole[name] = np.interp(time_s, time_s[there], values[there])
        notes.append(note)
    return whole, tuple(notes)


def several_rates(counts: RowCounts) -> tuple[str, ...]:
    """A word where most rows were dropped for a missing value."""
    lacking = counts.dropped.get("with a missing value", 0)
    if 2 * lacking <= counts.rows_in:
        return ()
    return (
        f"{lacking} of {counts.rows_in} rows lack a value and are dropped: for signals logged at several "
        'rates give missing = "interpolate" in a record file',
    )


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


def record_of_columns(
    vectors: Mapping[str, FloatArray],
    spec: RecordSpec,
    path: Path,
    digest: str,
    *,
    constants: Mapping[str, float] | None = None,
) -> Record:
    """Read the columns that a spec names; NaN and disorder in time are treated as in a CSV file."""
    names = [_name(column, tuple(vectors), path) for column in spec.columns(vectors)]
    table = _table([_vector(vectors, column, path) for column in names], names, path)
    account = Account(rows_in=len(table), columns=tuple(vectors))
    block = Block(values=table, lines=np.arange(1, len(table) + 1))
    rows = in_si(spec, account, f"{path}, row")(block)
    return replace(
        record_of_rows(rows, spec, path, account, digest), constants=MappingProxyType(dict(constants or {}))
    )


def in_si(spec: RecordSpec, account: Account, origin: str) -> Callable[[Block], FloatArray]:
    """What makes of one block after the other rows of time (s) and signals in SI, shape (n, 1 + signals)."""
    converters = [converter(signal) for signal in spec.signals]
    axis = TimeAxis(spec, account, origin)

    def convert(block: Block) -> FloatArray:
        time, values = axis.apply(block)
        account.rows_out += len(time)
        sums, first = [], 0
        for signal, own in zip(spec.signals, converters, strict=True):
            signs = [sign for sign, _ in signal.terms(account.columns)]
            sums.append(own(values[:, first : first + len(signs)] @ signs))
            first += len(signs)
        return np.column_stack([time, *sums])

    return convert


def record_of_rows(
    rows: FloatArray, spec: RecordSpec, path: Path, account: Account, digest: str, averaged: int = 1
) -> Record:
    """A record of rows of time and signals in SI, its holes filled."""
    counts = account.frozen()
    if len(rows) < 2:
        raise InputError(f"fewer than two usable rows ({counts})", where=str(path))
    time = np.ascontiguousarray(rows[:, 0])
    signals = {signal.name: np.ascontiguousarray(rows[:, k]) for k, signal in enumerate(spec.signals, 1)}
    signals, made = filled(time, signals, spec.resample_tolerance, str(path))
    notes = (f"averaged over {averaged} rows to bound memory",) if averaged > 1 else ()
    return Record(
        name=shown_path(path.name),
        time_s=time,
        signals=MappingProxyType(signals),
        units=MappingProxyType({signal.name: converter(signal).si_unit for signal in spec.signals}),
        counts=counts,
        averaged=averaged,
        sha256=digest,
        notes=(*notes, *made, *several_rates(counts)),
        inputs=inputs_of(spec, account.columns),
        resample_tolerance=spec.resample_tolerance,
    )


def _name(column: str | int, there: tuple[str, ...], path: Path) -> str:
    if isinstance(column, str):
        return column
    if not 1 <= column <= len(there):
        raise InputError(f"column {column}: the columns are numbered 1 to {len(there)}", where=str(path))
    return there[column - 1]


def _vector(vectors: Mapping[str, FloatArray], column: str, path: Path) -> FloatArray:
    if column not in vectors:
        there = ", ".join(f'"{key}"' for key in list(vectors)[:20]) or "none"
        raise InputError(f'no vector "{column}"; there are: {there}', where=str(path))
    vector = vectors[column]
    if max(vector.shape) != vector.size:
        raise InputError(f'"{column}" has the shape {vector.shape}: a vector is wanted', where=str(path))
    if np.isinf(vector).any():
        row = int(np.isinf(vector.ravel()).argmax()) + 1
        raise InputError(f'"{column}": not finite', where=f"{path}, row:{row}")
    return vector.ravel()


def _table(vectors: list[FloatArray], columns: list[str], path: Path) -> FloatArray:
    lengths = {column: len(vector) for column, vector in zip(columns, vectors, strict=True)}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{column} {length}" for column, length in lengths.items())
        raise InputError(f"the vectors differ in length: {told}", where=str(path))
    return np.column_stack(vectors)
