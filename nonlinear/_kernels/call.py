"""Prepare and run one row: the only way into the kernel."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nonlinear._kernels import layout
from nonlinear._kernels.elastic_prepare import prepare_elastic, prepare_elastic_sizes
from nonlinear._kernels.energy import prepare_forms
from nonlinear._kernels.lengths import lengthened
from nonlinear._kernels.prepare import prepare, prepare_run_sizes
from nonlinear._kernels.run import run
from nonlinear._kernels.smooth import prepare_tanh
from nonlinear._kernels.tick import init_elastic, init_run

Floats = npt.NDArray[np.float64]


def parameters(row: Floats) -> tuple[Floats, Floats]:
    """All parameters of a row with what is derived from them, and the state at t_0."""
    elastic = row[layout.ELASTIC_DRIVE] > 0.0

    def put_sizes(head: Floats) -> None:
        prepare_run_sizes(head)
        if elastic:
            prepare_elastic_sizes(head)

    p = lengthened(row, put_sizes)
    s = np.zeros(int(p[layout.STATE_SIZE]))
    prepare(p, s)
    if row[layout.WITH_ENERGY] > 0.0:
        prepare_forms(p, s)
    if row[layout.LAW] > 0.0:
        prepare_tanh(p, s)
    if elastic:
        prepare_elastic(p, s)
    init_run(p, s)
    if elastic:
        init_elastic(p, s)
    return p, s


def call(
    row: Floats,
    tables: Floats,
    history: Floats,
    flags: npt.NDArray[np.uint16],
    out: Floats,
    shared: Floats,
) -> int:
    """Run one row (see `run`); ``history`` is (columns, rows) or empty."""
    return resume(*parameters(row), tables, history, flags, out, shared)


def resume(
    p: Floats, s: Floats, tables: Floats, history: Floats, flags: npt.NDArray[np.uint16], out: Floats,
    shared: Floats,
) -> int:  # fmt: skip
    """Go on from the state ``s``, which is changed, until tick ``p[TICKS]``; see `call`."""
    io, block = np.zeros(layout.IO_SIZE), np.zeros(layout.BLOCK_SIZE)
    rare = 1.0 if p[layout.LAW] > 0.0 or p[layout.ELASTIC_DRIVE] > 0.0 else None
    return int(run(p, s, io, block, tables, history.reshape(-1), flags, out, shared, rare))
