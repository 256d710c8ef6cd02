"""A tick written into the history; a flat row, one column of ``rows`` numbers after the other."""

from __future__ import annotations

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout


@kernel
def record(p, io, history, rows, flag_history, row):
    """Write the columns that every run has, and those of active probes."""
    history[row] = io[layout.IO_REFERENCE]
    history[rows + row] = io[layout.IO_OUTPUT]
    history[2 * rows + row] = io[layout.IO_SPEED]
    history[3 * rows + row] = io[layout.IO_CURRENT]
    history[4 * rows + row] = io[layout.IO_VOLTAGE]
    history[5 * rows + row] = io[layout.IO_CURRENT_COMMAND]
    history[6 * rows + row] = io[layout.IO_SPEED_COMMAND]
    history[7 * rows + row] = io[layout.IO_ANGLE]
    flag_history[row] = int(io[layout.IO_FLAGS])
    if p[layout.PROBING] > 0.0 or p[layout.ELASTIC_DRIVE] > 0.0 or p[layout.RARE_LOAD] > 0.0:
        record_more(p, io, history, rows, row)


@kernel
def record_more(p, io, history, rows, row):
    """Write both sides of each active probe, by point, then an elastic drive's load side, then the load."""
    col = layout.HISTORY_PROBES
    if p[layout.PROBING] > 0.0:
        for point in range(4):
            if p[layout.PROBES + point * layout.PROBE_SIZE] > 0.0:
                history[col * rows + row] = io[layout.IO_PROBES + 2 * point]
                history[(col + 1) * rows + row] = io[layout.IO_PROBES + 2 * point + 1]
                col += 2
    if p[layout.ELASTIC_DRIVE] > 0.0:
        for j in range(layout.ELASTIC_COLUMNS):
            history[(col + j) * rows + row] = io[layout.IO_OUTPUT_SPEED + j]
        col += layout.ELASTIC_COLUMNS
    if p[layout.RARE_LOAD] > 0.0:
        history[col * rows + row] = io[layout.IO_MOMENT]
