"""Prepare and run one row: the only way into the kernel."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nonlinear._kernels import layout
from nonlinear._kernels.run import run
from nonlinear._kernels.segment import CONSTANTS, prepare
from nonlinear._kernels.smooth import LEVEL, LEVELS, prepare_tanh

Floats = npt.NDArray[np.float64]


def call(
    row: Floats,
    tables: Floats,
    history: Floats,
    flags: npt.NDArray[np.uint8],
    out: Floats,
    shared: Floats,
) -> int:
    """Run one row (see `run`); the tanh law is prepared, and compiled, only where it is used."""
    constants = np.zeros(CONSTANTS)
    prepare(row, constants)
    if row[layout.LAW] == 0.0:
        return int(run(row, constants, None, tables, history, flags, out, shared))
    table = np.zeros(2 * LEVELS * LEVEL)
    prepare_tanh(row, constants, table)
    return int(run(row, constants, table, tables, history, flags, out, shared))
