"""Records out of named columns of numbers: the time of each row, missing values, SI."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown_path
from actuator_lti.types import Floats, Ints, Mask
from analyses.records.inputs import inputs_of
from analyses.records.record import DISORDER, Record, RowCounts, check_error, line_error
from analyses.records.spec import RecordSpec, to_si, unit_factor


def filled(
    time_s: Floats, signals: Mapping[str, Floats], tolerance: float, where: str
) -> tuple[dict[str, Floats], list[str]]:
    """Signals without holes, linear between the values that there are; outside them the nearest is held.

    The notes tell what was filled, and the error of a straight line over one step of the values that there
    are, which may be ``tolerance`` of the signal's range.
    """
    whole, notes = dict(signals), []
    for name, values in signals.items():
        there = ~np.isnan(values)
        count = int(np.count_nonzero(there))
        if count == len(values):
            continue
        if count < 3:
            raise InputError(f"{name}: {count} values, three wanted", where=where)
        error = 0.25 * line_error(time_s[there], values[there], 2.0)
        note = f"{name}: {len(values) - count} of {len(values)} values missing, linear between the others, "
        note += f"error up to {100.0 * error:.2g} % of the range"
        check_error(error, tolerance, note, where)
        whole[name] = np.interp(time_s, time_s[there], values[there])
        notes.append(note)
    return whole, notes


LACKING = "with a missing value"


@dataclass(frozen=True, kw_only=True)
class Block:
    """Numbers of the wanted columns, shape (n, columns), NaN where missing, and the file line of each row."""

    values: Floats
    lines: Ints


class SiRows:
    """Turns blocks of raw rows into rows of time (s) and signals in SI, dropping and counting what is asked.

    The order: rows with a missing value, rows below the stated minimum of the raw time, wrap-around undone,
    rows whose time does not increase.
    """

    def __init__(self, spec: RecordSpec, counts: RowCounts, origin: str) -> None:
        self._spec, self._counts, self._origin = spec, counts, origin
        self._factor = spec.time.tick_s or unit_factor(spec.time.unit, "s", "time")
        self._factors = [to_si(signal)[0] for signal in spec.signals]
        self._wraps, self._last_time = 0.0, -np.inf
        self._last_raw: float | None = None

    def __call__(self, block: Block) -> Floats:
        """Rows of time and signals, shape (n, 1 + signals)."""
        spec, times = self._spec, self._spec.time
        block = self._without_missing(block)
        if times.period_s is not None:
            time, raw = (self._counts.rows_out + np.arange(len(block.values))) * times.period_s, block.values
        else:
            if times.minimum is not None:
                late = block.values[:, 0] >= times.minimum
                block = self._kept(block, late, f"time below {times.minimum:g} {times.unit}")
            time = self._unwrapped(block.values[:, 0]) * self._factor
            keep = self._increases(time, block)
            time, raw = time[keep], self._kept(block, keep, DISORDER).values[:, 1:]
        self._counts.rows_out += len(time)
        signals, first = [], 0
        for signal, factor in zip(spec.signals, self._factors, strict=True):
            signs = [sign for sign, _ in signal.terms(self._counts.columns)]
            signals.append((raw[:, first : first + len(signs)] @ signs + signal.offset) * factor)
            first += len(signs)
        return np.column_stack([time, *signals])

    def _without_missing(self, block: Block) -> Block:
        looked_at = block.values
        if self._spec.missing == "interpolate":  # the signals are filled later, the time is not
            looked_at = looked_at[:, : 0 if self._spec.time.period_s is not None else 1]
        missing = np.asarray(np.isnan(looked_at).any(axis=1))
        if missing.any() and self._spec.missing == "error":
            raise InputError("a value is missing", where=f"{self._origin}:{block.lines[missing.argmax()]}")
        return self._kept(block, ~missing, LACKING)

    def _kept(self, block: Block, keep: Mask, reason: str) -> Block:
        if keep.all():
            return block
        self._counts.drop(reason, f"line {block.lines[keep.argmin()]}", int(np.count_nonzero(~keep)))
        return Block(values=block.values[keep], lines=block.lines[keep])

    def _unwrapped(self, raw: Floats) -> Floats:
        wrap = self._spec.time.wrap
        if wrap is None or not len(raw):
            return raw
        before = raw[0] if self._last_raw is None else self._last_raw
        turns = np.cumsum(np.diff(raw, prepend=before) < -0.5 * wrap)
        unwrapped = raw + self._wraps + wrap * turns
        self._wraps += wrap * int(turns[-1])
        self._last_raw = float(raw[-1])
        return np.asarray(unwrapped)

    def _increases(self, time: Floats, block: Block) -> Mask:
        reached = np.maximum.accumulate(np.concatenate([[self._last_time], time]))
        self._last_time = float(reached[-1])
        keep = np.asarray(time > reached[:-1])
        if not keep.all() and self._spec.disorder == "error":
            k = int(keep.argmin())
            why = f"time {time[k]:.15g} s does not come after {reached[k]:.15g} s"
            if time[k] == reached[k]:
                why += ": a row twice, or stamps of too few digits (then give time.period, not a column)"
            why += '; allowed: rising times: a file for each run; or disorder = "drop" in a record file, '
            why += "which leaves out this row and all that follow up to the time that was reached"
            raise InputError(why, where=f"{self._origin}:{block.lines[k]}")
        return keep


def record_of_columns(vectors: Mapping[str, Floats], spec: RecordSpec, path: Path, digest: str) -> Record:
    """Read the columns that a spec names; NaN and disorder in time are treated as in a CSV file."""
    header = tuple(vectors)
    names = [header[k] for k in spec.positions(header, str(path))]
    columns = [vectors[name].ravel() for name in names]
    for name, column in zip(names, columns, strict=True):
        shape = vectors[name].shape
        if max(shape) != column.size:
            raise InputError(f'"{name}" has the shape {shape}: a vector is wanted', where=str(path))
        infinite = np.isinf(column)
        if infinite.any():
            raise InputError(f'"{name}": not finite', where=f"{path}, row:{infinite.argmax() + 1}")
    if len(set(map(len, columns))) > 1:
        lengths = ", ".join(f"{name} {len(column)}" for name, column in zip(names, columns, strict=True))
        raise InputError(f"the vectors differ in length: {lengths}", where=str(path))
    table = np.column_stack(columns)
    counts = RowCounts(rows_in=len(table), columns=header)
    block = Block(values=table, lines=np.arange(1, len(table) + 1))
    return record_of_rows(SiRows(spec, counts, f"{path}, row")(block), spec, path, counts, digest)


def record_of_rows(
    rows: Floats, spec: RecordSpec, path: Path, counts: RowCounts, digest: str, averaged: int = 1
) -> Record:
    """A record of rows of time and signals in SI, its holes filled."""
    if len(rows) < 2:
        raise InputError(f"fewer than two usable rows ({counts})", where=str(path))
    time, *columns = (np.ascontiguousarray(column) for column in rows.T)
    named = {signal.name: column for signal, column in zip(spec.signals, columns, strict=True)}
    signals, made = filled(time, named, spec.resample_tolerance, str(path))
    notes = [f"averaged over {averaged} rows to bound memory"] * (averaged > 1) + made
    lacking = counts.dropped.get(LACKING, 0)
    if 2 * lacking > counts.rows_in:
        notes.append(
            f"{lacking} of {counts.rows_in} rows lack a value and are dropped: for signals logged at several "
            'rates give missing = "interpolate" in a record file'
        )
    return Record(
        name=shown_path(path.name),
        time_s=time,
        signals=signals,
        units={signal.name: to_si(signal)[1] for signal in spec.signals},
        counts=counts,
        averaged=averaged,
        sha256=digest,
        notes=tuple(notes),
        inputs=inputs_of(spec, counts.columns),
        resample_tolerance=spec.resample_tolerance,
    )
