"""One whole run: the inputs of a block of ticks worked out ahead, then tick after tick."""

from __future__ import annotations

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.record import record
from nonlinear._kernels.reduce import clear, note_limits, reduce
from nonlinear._kernels.signals import feed, fill_block
from nonlinear._kernels.tick import step


@kernel
def run_block(p, s, io, block, first, count, history, flag_history, out):
    """Run ``count`` ticks from tick ``first`` on; returns the tick behind the last one done."""
    every, rows = int(p[layout.RECORD_EVERY]), flag_history.shape[0]
    row = int((first + every - 1) / every)
    to_record = row * every if rows > 0 else -1
    feeding = p[layout.PROBING] > 0.0 or p[layout.RARE_LOAD] > 0.0
    supplied = p[layout.SUPPLY] >= layout.SUPPLY_LIMITS
    reducing = p[layout.WINDOW] > 0.0 or p[layout.WITH_EXTREMES] > 0.0 or p[layout.STEP_TARGET] != 0.0
    flags, since, k = 0.0, first, first
    while k < first + count:
        io[layout.IN_COMMAND] = block[k - first]
        if feeding:
            feed(block, k - first, io)
        if supplied:
            io[layout.IN_BUS] = block[layout.BLOCK_SUPPLY + k - first]
        step(p, s, io)
        if io[layout.IO_FLAGS] != flags:
            note_limits(p, flags, since, k, out)
            flags, since = io[layout.IO_FLAGS], k
        if k == to_record:
            record(p, io, history, rows, flag_history, row)
            row += 1
            to_record += every
        if reducing:
            reduce(p, io, k, out)
        k += 1
        if s[layout.S_STATUS] > 0.0:
            break
    note_limits(p, flags, since, k, out)
    return k


@kernel
def finish(p, s, k, out):
    """Write the final state and the counts into the results."""
    out[layout.OUT_TICKS] = k
    out[layout.OUT_EVENTS], out[layout.OUT_MAX_EVENTS] = s[layout.S_EVENTS], s[layout.S_MAX_EVENTS]
    out[layout.OUT_CURRENT], out[layout.OUT_SPEED] = s[layout.S_CURRENT], s[layout.S_SPEED]
    out[layout.OUT_ANGLE] = s[layout.S_ANGLE]
    out[layout.OUT_CURRENT_INTEGRATOR] = s[layout.S_CURRENT_INTEGRATOR]
    out[layout.OUT_VELOCITY_INTEGRATOR] = s[layout.S_VELOCITY_INTEGRATOR]
    out[layout.OUT_SPEED_COMMAND] = s[layout.S_SPEED_COMMAND]
    out[layout.OUT_CURRENT_COMMAND] = s[layout.S_CURRENT_REFERENCE]
    out[layout.OUT_VOLTAGE] = s[layout.S_VOLTAGE]
    if p[layout.ELASTIC_DRIVE] > 0.0:
        out[layout.OUT_OUTPUT], out[layout.OUT_OUTPUT_SPEED] = s[layout.S_OUTPUT], s[layout.S_OUTPUT_SPEED]
        out[layout.OUT_TWIST] = s[elastic_layout.ES_TWIST]
    for j in range(layout.ENERGY_SIZE):
        out[layout.OUT_ENERGY + j] = s[layout.S_ENERGY + j]


@kernel
def run(p, s, io, block, tables, history, flag_history, out, shared):
    """Run the drive described by ``p`` from the state ``s``; returns a status number of ``layout``.

    ``history`` is flat, columns one after the other, or empty; ``flag_history`` one number a row; ``out`` a
    row of results; ``shared[0]`` is set to the ticks done from time to time, a non-zero ``shared[1]`` stops
    the run.
    """
    clear(p, out)
    s[elastic_layout.ES_ROOM] = 0.0  # the state may have been changed
    ticks, k = int(p[layout.TICKS]), int(s[layout.S_TICK])
    # nobody sees the command between updates of the outermost stage unless the run is looked at
    looked_at = flag_history.shape[0] > 0 or p[layout.WINDOW] > 0.0 or p[layout.WITH_EXTREMES] > 0.0
    stride = 1 if looked_at else int(p[layout.OUTER_EVERY])
    while k < ticks and s[layout.S_STATUS] == 0.0:
        count = min(layout.BLOCK, ticks - k)
        fill_block(p, tables, k, count, stride, block)
        k = run_block(p, s, io, block, k, count, history, flag_history, out)
        shared[0] = k
        if shared[1] != 0.0 and s[layout.S_STATUS] == 0.0:
            s[layout.S_STATUS] = float(layout.CANCELLED)
    finish(p, s, k, out)
    return int(s[layout.S_STATUS])
