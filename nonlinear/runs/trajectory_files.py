"""Trajectories as files, written whole or not at all."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

from actuator_lti.files.atomic import write_stream
from actuator_lti.start.extras import need

if TYPE_CHECKING:
    from nonlinear.runs.trajectory import Trajectory


def write_csv(run: Trajectory, path: str | PathLike[str]) -> None:
    """Write a trajectory as CSV; flags as 0 and 1."""
    need("pyarrow", "tables", "a CSV file of a run")
    import pyarrow as pa
    import pyarrow.csv

    columns = {name: (v.astype("u1") if v.dtype == bool else v) for name, v in run.columns().items()}
    table = pa.table(columns)
    options = pyarrow.csv.WriteOptions(quoting_style="none")
    write_stream(path, lambda file: pyarrow.csv.write_csv(table, file, options))


def write_parquet(run: Trajectory, path: str | PathLike[str]) -> None:
    """Write a trajectory as Parquet."""
    need("pyarrow", "tables", "a Parquet file")
    import pyarrow as pa
    import pyarrow.parquet

    about = {"design": run.design_name, "parameters": run.parameters_hash, "status": run.status}
    table = pa.table(run.columns()).replace_schema_metadata(about)
    write_stream(path, lambda file: pyarrow.parquet.write_table(table, file))
