"""Records out of named columns of numbers, whatever file they came from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.reading import shown_path
from analyses.records.csv_rows import Account, Block
from analyses.records.gaps import filled, several_rates
from analyses.records.inputs import inputs_of
from analyses.records.record import FloatArray, Record
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
    columns = [] if spec.time.column is None else [spec.time.column]
    columns += [signal.column for signal in spec.signals]
    names = [_name(column, tuple(vectors), path) for column in columns]
    table = _table([_vector(vectors, column, path) for column in names], names, path)
    account = Account(rows_in=len(table))
    axis = TimeAxis(spec, account, f"{path}, row")
    time, values = axis.apply(Block(values=table, lines=np.arange(1, len(table) + 1)))
    account.rows_out = len(time)
    if len(time) < 2:
        raise InputError(f"fewer than two usable rows ({account.frozen()})", where=str(path))
    converters = [converter(signal) for signal in spec.signals]
    signals = {
        c.name: convert(values[:, k])
        for k, (c, convert) in enumerate(zip(spec.signals, converters, strict=True))
    }
    signals, notes = filled(time, signals, spec.resample_tolerance, str(path))
    return Record(
        name=shown_path(path.name),
        time_s=time,
        signals=MappingProxyType(signals),
        units=MappingProxyType({s.name: c.si_unit for s, c in zip(spec.signals, converters, strict=True)}),
        counts=account.frozen(),
        sha256=digest,
        constants=MappingProxyType(dict(constants or {})),
        notes=(*notes, *several_rates(account.frozen())),
        inputs=inputs_of(spec, tuple(vectors)),
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
