"""The value of a command, a bias or an injected signal at a tick."""

from __future__ import annotations

import math

import numpy as np

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout

TWO_PI = 2.0 * math.pi
TABLES = np.array(layout.TABLES)
TO = np.array([layout.BLOCK_LOAD, layout.BLOCK_TORQUE, layout.BLOCK_SUPPLY])  # where each goes


@kernel
def triangle_wave(cycles):
    """Triangle of amplitude 1 in phase with sin(2 pi cycles)."""
    x = cycles + 0.25
    x -= math.floor(x)
    return 4.0 * x - 1.0 if x < 0.5 else 3.0 - 4.0 * x


@kernel
def chirp_cycles(kind, f0, f1, span, s):
    """Cycles since the start of a linear or logarithmic chirp from f0 to f1 over ``span`` seconds."""
    x = min(s, span)
    if kind == layout.CHIRP:
        cycles = f0 * x + 0.5 * (f1 - f0) * x * x / span
    else:
        rate = math.log(f1 / f0) / span
        cycles = f0 * x if rate == 0.0 else f0 * math.expm1(rate * x) / rate
    return cycles + f1 * max(s - span, 0.0)


@kernel
def signal(row, at, tables, k, period):
    """Value at tick k of the signal whose eight numbers begin at ``row[at]``.

    Numbers: kind, amplitude, start time, then frequency and phase (sine, triangle), stop time (ramp),
    f0, f1 and span (chirps), offset and length in ``tables`` (table: held after its end).
    """
    kind = int(row[at])
    if kind == layout.NONE:
        return 0.0
    amplitude = row[at + 1]
    if kind == layout.TABLE:
        offset, length = int(row[at + 3]), int(row[at + 4])
        return amplitude * tables[offset + min(k, length - 1)]
    s = k * period - row[at + 2]
    if s < -1e-9 * period:
        return 0.0
    if kind == layout.SINE:
        return amplitude * math.sin(TWO_PI * row[at + 3] * s + row[at + 4])
    if kind == layout.STEP:
        return amplitude
    if kind == layout.RAMP:
        return amplitude * min(s, row[at + 3])
    if kind == layout.TRIANGLE:
        return amplitude * triangle_wave(row[at + 3] * s + row[at + 4] / TWO_PI)
    return amplitude * math.sin(TWO_PI * chirp_cycles(kind, row[at + 3], row[at + 4], row[at + 5], s))


@kernel
def fill(row, at, tables, first, count, stride, period, out, to):
    """Sample a signal at ticks first, first + stride, ... of ``count``, into ``out[to]`` and behind."""
    times = int((count + stride - 1) / stride)
    if int(row[at]) == layout.SINE:
        amplitude, turn, phase = row[at + 1], TWO_PI * row[at + 3], row[at + 4]
        for n in range(times):
            t = (first + n * stride) * period - row[at + 2]
            out[to + n * stride] = 0.0 if t < -1e-9 * period else amplitude * math.sin(turn * t + phase)
        return
    for n in range(times):
        out[to + n * stride] = signal(row, at, tables, first + n * stride, period)


@kernel
def fill_block(p, tables, first, count, stride, block):
    """Work out all inputs of ``count`` ticks from tick ``first`` on; commands only every ``stride`` ticks."""
    period = p[layout.PERIOD]
    start = stride * int((first + stride - 1) / stride) - first
    fill(p, layout.COMMAND, tables, first + start, count - start, stride, period, block, start)
    if p[layout.BIAS] > 0.0:
        for j in range(count):
            block[j] += signal(p, layout.BIAS, tables, first + j, period)
    for point in range(4):
        at = layout.PROBES + point * layout.PROBE_SIZE
        if p[at] > 0.0:
            to = layout.BLOCK_PROBES + point * layout.BLOCK
            fill(p, at + layout.PROBE_SIGNAL, tables, first, count, layout.EVERY_TICK, period, block, to)
    for j in range(TABLES.shape[0]):  # one value a tick, the last one held
        start, length = int(p[TABLES[j]]), int(p[TABLES[j] + 1])
        if length > 0:
            for n in range(count):
                block[TO[j] + n] = tables[start + min(first + n, length - 1)]


@kernel
def feed(block, j, io):
    """Hand the inputs beside the command of the j-th tick of a block to the drive."""
    io[layout.IN_LOAD], io[layout.IN_TORQUE] = block[layout.BLOCK_LOAD + j], block[layout.BLOCK_TORQUE + j]
    for point in range(4):
        io[layout.IN_PROBE + point] = block[layout.BLOCK_PROBES + point * layout.BLOCK + j]
