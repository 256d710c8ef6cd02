"""One whole run: inputs ahead, tick after tick; its history, or what is kept where there is none."""

import math

import numpy as np

from actuator_lti.compiled.kernel import seldom
from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.signals import feed, fill_block
from nonlinear._kernels.tick import step

KERNELS = True

LIMITER_BITS = np.array(layout.LIMITER_BITS)


def record(p, io, history, rows, flag_history, row):
    """Write a row: what every run has, active probes, an elastic drive's load side, a load that varies."""
    for j in range(layout.BASE_SIGNALS):
        history[j * rows + row] = io[layout.IO_REFERENCE + j]
    history[layout.HISTORY_ANGLE * rows + row] = io[layout.IO_ANGLE]
    flag_history[row] = int(io[layout.IO_FLAGS])
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
    if p[layout.LOAD_VARIES] > 0.0:
        history[col * rows + row] = io[layout.IO_MOMENT]


def clear(p, out):
    """Reset a row of results for a run."""
    for j in range(layout.OUT_SIZE):
        out[j] = 0.0
    for j in range(layout.LIMITER_COUNT):
        out[layout.OUT_LIMIT_FIRST + j] = -1.0
    for j in range(layout.ALL_SIGNALS):
        out[layout.OUT_EXTREMES + 2 * j] = math.inf
        out[layout.OUT_EXTREMES + 2 * j + 1] = -math.inf
        for w in range(layout.WINDOWS):
            at = layout.OUT_WINDOWS + (w * layout.ALL_SIGNALS + j) * layout.WINDOW_SIGNAL
            out[at + 2], out[at + 3] = math.inf, -math.inf
    out[layout.OUT_STEP + layout.STEP_T10] = out[layout.OUT_STEP + layout.STEP_T90] = -1.0
    out[layout.OUT_STEP + layout.STEP_SETTLED] = -1.0
    if p[layout.WINDOW] > 0.0:
        turn = 2.0 * math.pi * p[layout.CYCLES] / p[layout.WINDOW]
        out[layout.OUT_PHASOR + 2], out[layout.OUT_PHASOR + 3] = math.cos(turn), math.sin(turn)


def followed(p, io):
    """What the command orders: way of the output since the start, its speed, current, voltage."""
    if p[layout.HAS_POSITION] > 0.0:
        return io[layout.IO_OUTPUT] - p[layout.ANGLE_START] / p[layout.RATIO]
    if p[layout.HAS_VELOCITY] > 0.0:
        return io[layout.IO_SPEED] / p[layout.RATIO]
    return io[layout.IO_CURRENT] if p[layout.HAS_CURRENT] > 0.0 else io[layout.IO_VOLTAGE]


def step_figures(y, y_last, k, band, out):
    """Update rise, peak and settling of a response normalised to its target; times in ticks."""
    at = layout.OUT_STEP
    if out[at + layout.STEP_T10] < 0.0 and y >= 0.1:
        out[at + layout.STEP_T10] = k - (y - 0.1) / (y - y_last) if k > 0 else 0.0
    if out[at + layout.STEP_T90] < 0.0 and y >= 0.9:
        out[at + layout.STEP_T90] = k - (y - 0.9) / (y - y_last) if k > 0 else 0.0
    out[at + layout.STEP_PEAK] = max(out[at + layout.STEP_PEAK], y)
    if abs(y - 1.0) > band:
        out[at + layout.STEP_SETTLED] = -1.0
    elif out[at + layout.STEP_SETTLED] < 0.0:
        out[at + layout.STEP_SETTLED] = k
    out[at + layout.STEP_LAST] = y


@seldom
def note_limits(p, flags, first, until, out):
    """Count the ticks from ``first`` to ``until`` (exclusive), in which the same limiters acted."""
    ticks = until - first
    window = max(until - max(float(first), p[layout.TICKS] - p[layout.WINDOW]), 0.0)
    bits = int(flags)
    for j in range(layout.LIMITER_COUNT):
        if bits & LIMITER_BITS[j]:
            out[layout.OUT_LIMIT_TICKS + j] += ticks
            out[layout.OUT_WINDOW_LIMITS + j] += window
            if out[layout.OUT_LIMIT_FIRST + j] < 0.0:
                out[layout.OUT_LIMIT_FIRST + j] = first
    if bits & layout.FLAG_STICK:
        out[layout.OUT_STICK_TICKS] += ticks
        out[layout.OUT_WINDOW_STICK] += window


def add_to_window(p, io, k, count, out):
    """Add tick k to the last window or the one before it, by the unit phasor of the fundamental."""
    length = int(p[layout.WINDOW])
    into = k - (int(p[layout.TICKS]) - 2 * length)
    if into < 0:
        return
    at = layout.OUT_PHASOR
    if into == 0 or into == length:
        out[at], out[at + 1] = 1.0, 0.0
    c, s = out[at], out[at + 1]
    out[at], out[at + 1] = c * out[at + 2] - s * out[at + 3], c * out[at + 3] + s * out[at + 2]
    first = layout.ALL_SIGNALS if into < length else 0
    for j in range(count):
        x = io[layout.IO_REFERENCE + j]
        at = layout.OUT_WINDOWS + (first + j) * layout.WINDOW_SIGNAL
        out[at] += x
        out[at + 1] += x * x
        out[at + 2] = min(out[at + 2], x)
        out[at + 3] = max(out[at + 3], x)
        re, im = c, s
        for h in range(int(p[layout.HARMONICS])):
            out[at + layout.WINDOW_BASE + 2 * h] += x * re
            out[at + layout.WINDOW_BASE + 2 * h + 1] += x * im
            re, im = re * c - im * s, re * s + im * c


def reduce(p, io, k, out):
    """Add tick k to whatever is kept of the run."""
    if p[layout.STEP_TARGET] != 0.0:
        y = followed(p, io) / p[layout.STEP_TARGET]
        step_figures(y, out[layout.OUT_STEP_BEFORE], k, p[layout.STEP_BAND], out)
        out[layout.OUT_STEP_BEFORE] = y
    count = layout.ALL_SIGNALS if p[layout.PROBING] > 0.0 else layout.BASE_SIGNALS
    if p[layout.WITH_EXTREMES] > 0.0:
        for j in range(count):
            at = layout.OUT_EXTREMES + 2 * j
            out[at] = min(out[at], io[layout.IO_REFERENCE + j])
            out[at + 1] = max(out[at + 1], io[layout.IO_REFERENCE + j])
    if p[layout.WINDOW] > 0.0:
        add_to_window(p, io, k, count, out)


def run_block(p, s, io, block, first, count, history, flag_history, out):
    """Run ``count`` ticks from tick ``first`` on; returns the tick behind the last one done."""
    every, rows = int(p[layout.RECORD_EVERY]), flag_history.shape[0]
    row = int((first + every - 1) / every)
    to_record = row * every if rows > 0 else -1
    feeding = p[layout.PROBING] > 0.0 or p[layout.LOAD_VARIES] > 0.0
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


def run(p, s, io, block, tables, history, flag_history, out, shared):
    """Run the drive described by ``p`` from the state ``s``; returns a status number of ``layout``."""
    # history: columns one after the other, or empty; flag_history: a number a row; out: a row of results;
    # shared[0]: ticks done, told from time to time; a non-zero shared[1] stops the run
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
    out[layout.OUT_TICKS], out[layout.OUT_TWIST] = k, s[elastic_layout.ES_TWIST]
    for j in range(layout.S_COMMAND_CHAIN):  # the final state, its energies with it
        out[layout.OUT_STATE + j] = s[j]
    return int(s[layout.S_STATUS])
