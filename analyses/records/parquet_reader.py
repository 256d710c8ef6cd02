"""Parquet files as records."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from actuator_lti.bounds import CSV_COLUMNS, TABLE_BYTES, TABLE_ROWS
from actuator_lti.errors import InputError
from actuator_lti.files.reading import read_bytes, shown_path
from actuator_lti.start.extras import need
from analyses.estimation.arrays import FloatArray


def load_parquet(path: Path) -> tuple[Mapping[str, FloatArray], str]:
    """The columns of numbers by name, NaN where a value is missing, and the file's SHA-256."""
    need("pyarrow", "tables", "a Parquet file")
    import pyarrow as pa
    import pyarrow.parquet as pq

    where = shown_path(path)
    data = read_bytes(path, "Parquet file", TABLE_BYTES)
    try:
        file = pq.ParquetFile(BytesIO(data))
        TABLE_ROWS.check(file.metadata.num_rows, where)
        CSV_COLUMNS.check(file.metadata.num_columns, where)
        table = file.read()
    except (OSError, pa.ArrowException, UnicodeDecodeError) as error:  # the last of names of columns
        raise InputError(f"is no Parquet file: {error}", where=where) from None
    result = {}
    for field in table.schema:
        if pa.types.is_integer(field.type) or pa.types.is_floating(field.type):
            column = table.column(field.name).cast(pa.float64(), safe=False)
            result[field.name] = np.asarray(column.to_numpy(), dtype=np.float64)
        elif pa.types.is_timestamp(field.type):
            stamps = table.column(field.name).cast(pa.timestamp("ns")).to_numpy()
            since = (stamps - stamps[:1]) / np.timedelta64(1, "ns")
            result[f"{field.name} [s]"] = 1e-9 * np.asarray(since, dtype=np.float64)
    return result, hashlib.sha256(data).hexdigest()
