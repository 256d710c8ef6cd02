"""Records out of named columns of numbers, whatever file they came from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown_path
from analyses.estimation.arrays import FloatArray
from analyses.records.csv_rows import Account, Block
from analyses.records.gaps import filled, several_rates
from analyses.records.inputs import inputs_of
from analyses.records.record import Record
from analyses.records.spec import RecordSpec
from analyses.records.time_axis import TimeAxis
from analyses.records.units import converter


def record_of_columns(
    vectors: Mapping[str, FloatArray],
    spec: RecordSpec,
    path: Path,
    digest: str,
    *,
    constants: Mapping[str, float] | None = None,
) -> Record:
    """Read the columns that a spec names; NaN and disorder in time are treated as in a CSV file, and counted.

    Raises
    ------
    InputError
        Names the file, the column and the reason.
    """
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
    """A record of rows of time and signals in SI, its holes filled.

    Raises
    ------
    InputError
        For fewer than two rows, or holes too large to fill.
    """
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
