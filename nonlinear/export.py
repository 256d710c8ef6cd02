"""Trajectories as files, written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from actuator_lti.errors import InputError

if TYPE_CHECKING:
    from nonlinear.trajectory import Trajectory


def write_csv(run: Trajectory, path: str | PathLike[str]) -> None:
    """Write a trajectory as CSV; flags as 0 and 1."""
    import pyarrow as pa
    import pyarrow.csv

    columns = {name: (v.astype("u1") if v.dtype == bool else v) for name, v in run.columns().items()}
    table = pa.table(columns)
    options = pyarrow.csv.WriteOptions(quoting_style="none")
    _replace(path, lambda file: pyarrow.csv.write_csv(table, file, options))


def write_parquet(run: Trajectory, path: str | PathLike[str]) -> None:
    """Write a trajectory as Parquet."""
    import pyarrow as pa
    import pyarrow.parquet

    about = {"design": run.design_name, "parameters": run.parameters_hash, "status": run.status}
    table = pa.table(run.columns()).replace_schema_metadata(about)
    _replace(path, lambda file: pyarrow.parquet.write_table(table, file))


def _replace(path: str | PathLike[str], write: Callable[[BinaryIO], None]) -> None:
    """Write into a neighbour and move it into place."""
    target = Path(path)
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", where=str(target)) from error
    try:
        with os.fdopen(handle, "wb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
