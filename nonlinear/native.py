"""The compiled tick: runs, single ticks and signals, by the library of the kernels.

``python -m nonlinear.native`` compiles it, and the libraries of many designs' figures and of margins
beside it; an installation does so (`actuator_lti.compiled.library`).
"""

import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt

from actuator_lti.compiled.library import Entry, Library, source_files
from actuator_lti.drive import signals
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.forms import forms

Flags = npt.NDArray[np.uint16]

_FOLDER = Path(__file__).parent
_START, _TICK = "nonlinear._kernels.start", "nonlinear._kernels.tick"
_ENTRIES = (
    Entry(_START, "prepare_sizes", ("row",)),
    Entry(_START, "derive", ("row", "row")),
    Entry(_START, "init", ("row", "row")),
    Entry(_TICK, "tick", ("row", "row", "row"), "int"),
    Entry("nonlinear._kernels.control", "control_tick", ("row", "row", "row"), "float"),
    Entry("nonlinear._kernels.signals", "fill",
          ("row", "int", "row", "int", "int", "int", "float", "row", "int")),
    Entry("nonlinear._kernels.run", "run",
          ("row", "row", "row", "row", "row", "row", "bytes", "row", "row"), "int"),
)  # fmt: skip
LIBRARY = Library("run", _FOLDER, _ENTRIES, source_files(_FOLDER / "_kernels", Path(signals.__file__)), forms)


def resume(
    p: Floats, s: Floats, tables: Floats, history: Floats, flags: Flags, out: Floats, shared: Floats
) -> int:
    """Go on from the state ``s`` to tick ``p[TICKS]``; ``history`` is (columns, rows) or empty."""
    io, block = np.zeros(layout.IO_SIZE), np.zeros(layout.BLOCK_SIZE)
    return int(LIBRARY.functions.run(p, s, io, block, tables, history.reshape(-1), flags, out, shared))


def parameters(row: Floats) -> tuple[Floats, Floats]:
    """All parameters of a row with what is derived from them, and the state at t_0."""
    functions = LIBRARY.functions
    head = np.zeros(elastic_layout.EL_LEAST)
    head[: layout.SIZE] = row
    functions.prepare_sizes(head)
    p = np.zeros(int(head[layout.PARAMETER_SIZE]))
    known = min(p.size, head.size)
    p[:known] = head[:known]
    s = np.zeros(int(p[layout.STATE_SIZE]))
    functions.derive(p, s)
    functions.init(p, s)
    return p, s


def tick(p: Floats, s: Floats, io: Floats) -> int:
    """One tick; returns its status."""
    return int(LIBRARY.functions.tick(p, s, io))


def control_tick(p: Floats, s: Floats, io: Floats) -> float:
    """One tick of the controller alone; returns the voltage."""
    return float(LIBRARY.functions.control_tick(p, s, io))


def fill(signal: Floats, table: Floats, period_s: float, out: Floats) -> None:
    """Sample a signal at every tick, see `nonlinear._kernels.signals`."""
    LIBRARY.functions.fill(signal, 0, table, 0, out.size, 1, period_s, out, 0)


def build() -> tuple[Path, ...]:
    """Compile what is not there yet: this library, those of many designs' figures and of margins.

    Raises `InputError`: without a C compiler, or where the package cannot be written.
    """
    from actuator_lti.axis.library import LIBRARY as axis
    from actuator_lti.batch.library import LIBRARY as figures

    return tuple(library.build() for library in (LIBRARY, figures, axis))


if __name__ == "__main__":
    try:
        sys.stdout.write("".join(f"{path.name}\n" for path in build()))
    except InputError as error:
        sys.exit(f"the simulator is not compiled: {error}")
