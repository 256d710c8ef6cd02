"""MATLAB files (level 5, not the HDF5 of 7.3) as records."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from actuator_lti.errors import InputError
from analyses.records.csv_rows import Account, Block
from analyses.records.mat5 import MAX_BYTES, read_mat5
from analyses.records.record import FloatArray, Record
from analyses.records.spec import RecordSpec
from analyses.records.time_axis import TimeAxis
from analyses.records.units import converter


def read_mat_record(path: str | Path, spec: RecordSpec, *, name: str | None = None) -> Record:
    """Read vectors of a MATLAB file into a record; its scalars become ``constants``.

    The columns of the spec are variable names. Rows with NaN and disorder in time are treated as in a CSV
    file, and counted.

    Raises
    ------
    InputError
        Names the file, the variable and the reason.
    """
    path = Path(path)
    variables, digest = _load(path)
    vectors = {key: value for key, value in variables.items() if value.size > 1}
    columns = [] if spec.time.column is None else [str(spec.time.column)]
    columns += [str(signal.column) for signal in spec.signals]
    table = _table([_vector(vectors, column, path) for column in columns], columns, path)
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
    return Record(
        name=name or path.name,
        time_s=time,
        signals=MappingProxyType(signals),
        units=MappingProxyType({s.name: c.si_unit for s, c in zip(spec.signals, converters, strict=True)}),
        counts=account.frozen(),
        sha256=digest,
        constants=MappingProxyType({k: float(v.ravel()[0]) for k, v in variables.items() if v.size == 1}),
    )


def _load(path: Path) -> tuple[Mapping[str, FloatArray], str]:
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise InputError(
                f"{size} bytes: a .mat file of at most {MAX_BYTES} bytes is read", where=str(path)
            )
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", where=str(path)) from None
    try:
        content = read_mat5(data)
    except InputError as error:
        raise InputError(error.message, where=str(path)) from None
    arrays = {key: value for key, value in content.arrays.items() if value.size}
    return arrays, hashlib.sha256(data).hexdigest()


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
