"""MATLAB files (level 5, not the HDF5 of 7.3) as records: vectors by name, or a matrix with named columns."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from actuator_lti.bounds import MAT_BYTES
from actuator_lti.errors import InputError
from actuator_lti.files.mat5 import MatContent, read_mat5
from actuator_lti.files.reading import read_bytes
from analyses.estimation.arrays import FloatArray
from analyses.records.record import Record
from analyses.records.spec import CsvFormat, RecordSpec
from analyses.records.table_record import record_of_columns


def read_mat_record(path: str | Path, spec: RecordSpec) -> Record:
    """Read vectors of a MATLAB file into a record; its scalars become ``constants``.

    The columns of the spec are variable names (``group.field`` for those of a structure), or columns of
    the matrix that ``spec.format.matrix`` names.

    Raises
    ------
    InputError
        Names the file, the variable and the reason.
    """
    path = Path(path)
    content, digest = load_mat(path)
    vectors = columns_of(content, spec.format, path)
    constants = {k: float(v.ravel()[0]) for k, v in content.arrays.items() if v.size == 1}
    return record_of_columns(vectors, spec, path, digest, constants=constants)


def load_mat(path: Path) -> tuple[MatContent, str]:
    """The content of a file, without its empty arrays, and its SHA-256."""
    data = read_bytes(path, ".mat file", MAT_BYTES)
    try:
        content = read_mat5(data)
    except InputError as error:
        raise InputError(error.message, where=str(path)) from None
    content.arrays = {key: value for key, value in content.arrays.items() if value.size}
    return content, hashlib.sha256(data).hexdigest()


def columns_of(content: MatContent, layout: CsvFormat, path: Path) -> Mapping[str, FloatArray]:
    """The vectors of a file by name; where the layout names a matrix, its columns.

    The columns of a matrix are named by the layout's ``names``, or by the only list of texts in the file
    that has as many entries.
    """
    if not layout.matrix:
        return {key: value for key, value in content.arrays.items() if value.size > 1}
    matrix = content.arrays.get(layout.matrix)
    if matrix is None or matrix.ndim != 2:
        there = ", ".join(f'"{k}" {"x".join(map(str, v.shape))}' for k, v in content.arrays.items())
        raise InputError(
            f'matrix = "{layout.matrix}": no such matrix; there are: {there or "none"}', where=str(path)
        )
    names = layout.names or names_in(content, matrix.shape[1])
    if len(names) != matrix.shape[1]:
        raise InputError(
            f'matrix "{layout.matrix}" has {matrix.shape[1]} columns, {len(names)} names are given: '
            "names = [...] must name each",
            where=str(path),
        )
    return {name: matrix[:, k] for k, name in enumerate(names)}


def names_in(content: MatContent, count: int) -> tuple[str, ...]:
    """The only list of so many texts in a file; empty where there is none or more than one."""
    lists = [texts for texts in content.texts.values() if len(texts) == count]
    return tuple(lists[0]) if len(lists) == 1 else ()
