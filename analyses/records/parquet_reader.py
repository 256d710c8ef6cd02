"""Parquet files as records."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from actuator_lti.bounds import MAT_VALUES, TABLE_BYTES
from actuator_lti.errors import InputError
from actuator_lti.reading import read_bytes
from analyses.records.record import FloatArray, Record
from analyses.records.spec import RecordSpec
from analyses.records.table_record import record_of_columns


def read_parquet_record(path: str | Path, spec: RecordSpec, *, name: str | None = None) -> Record:
    """Read columns of a Parquet file into a record; columns that hold no numbers are left out.

    Raises
    ------
    InputError
        Names the file, the column and the reason.
    """
    path = Path(path)
    data = read_bytes(path, "Parquet file", TABLE_BYTES)
    digest = hashlib.sha256(data).hexdigest()
    return record_of_columns(_columns(data, path), spec, path, digest, name=name)


def parquet_columns(path: Path) -> Mapping[str, FloatArray]:
    """The columns of numbers by name; a value that is missing is NaN."""
    return _columns(read_bytes(path, "Parquet file", TABLE_BYTES), path)


def _columns(data: bytes, path: Path) -> Mapping[str, FloatArray]:
    """As `parquet_columns`; counted by what the head announces before it is unpacked."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        file = pq.ParquetFile(BytesIO(data))
        MAT_VALUES.check(file.metadata.num_rows * file.metadata.num_columns, str(path))
        table = file.read()
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"is no Parquet file: {error}", where=str(path)) from None
    found = {}
    for field in table.schema:
        if pa.types.is_integer(field.type) or pa.types.is_floating(field.type):
            column = table.column(field.name).cast(pa.float64(), safe=False)
            found[field.name] = np.asarray(column.to_numpy(), dtype=np.float64)
    return found
