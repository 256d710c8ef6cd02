"""The emitted C of a whole run, compiled for this very machine where it is measured."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from nonlinear._kernels import layout as at
from nonlinear.export.build import compile_files
from nonlinear.export.run_library import run_sources
from nonlinear.native import call_library, loaded

FLAGS = ("-O3", "-march=native", "-fPIC", "-shared")


class CSimulator:
    """A run of the exported code; needs gcc."""

    def __init__(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "run.so"
            path.write_bytes(compile_files(run_sources(), path.name, "this machine", FLAGS, command=["gcc"]))
            self._library = loaded(path)  # stays mapped when the file goes

    def run(self, row: np.ndarray, history: np.ndarray, flags: np.ndarray) -> int:
        """Fill history (8, ticks) and flags (ticks,) of the run that a row describes; its status."""
        out, shared, tables = np.zeros(at.OUT_SIZE), np.zeros(2), np.zeros(1)
        return call_library(self._library, row, tables, history, flags, out, shared)
