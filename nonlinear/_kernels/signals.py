"""The value of a command, a bias or an injected signal at a tick."""

import math
from fractions import Fraction

import numpy as np

from actuator_lti.compiled.kernel import wide
from nonlinear._kernels import layout

KERNELS = True

TWO_PI = 2.0 * math.pi
PI = Fraction("3.14159265358979323846264338327950288419716939937510582097")
PI_1 = int(PI * 2**31) / 2**31  # pi in three parts: n times each of the first two is exact
PI_2 = int((PI - Fraction(PI_1)) * 2**65) / 2**65
PI_3 = float(PI - Fraction(PI_1) - Fraction(PI_2))
PER_PI = 1.0 / math.pi
ROUNDER = 1.5 * 2.0**52  # a number added to it, and it taken away again, is rounded to a whole one
LARGEST = 2.0**20 * PI_1
SERIES = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(11))
S1, S2, S3, S4, S5, S6, S7, S8, S9, S10 = SERIES[1:]
TABLES = np.array(layout.TABLES)
TO = np.array([layout.BLOCK_LOAD, layout.BLOCK_TORQUE, layout.BLOCK_SUPPLY])  # where each goes


def sine(x):
    """sin x for abs(x) < `LARGEST`: its series about the nearest multiple of pi, to 1e-18."""
    # a library's differs in the last digit between machines, and is asked for one number at a time
    n = (x * PER_PI + ROUNDER) - ROUNDER
    odd = n - 2.0 * ((0.5 * n + ROUNDER) - ROUNDER)  # -1, 0 or 1
    r = ((x - n * PI_1) - n * PI_2) - n * PI_3
    y = r * r
    high = y * (S5 + y * (S6 + y * (S7 + y * (S8 + y * (S9 + y * S10)))))
    return (1.0 - 2.0 * odd * odd) * (r + r * (y * (S1 + y * (S2 + y * (S3 + y * (S4 + high))))))


def triangle_wave(cycles):
    """Triangle of amplitude 1 in phase with sin(2 pi cycles)."""
    x = cycles + 0.25
    x -= math.floor(x)
    return 4.0 * x - 1.0 if x < 0.5 else 3.0 - 4.0 * x


def chirp_cycles(kind, f0, f1, span, s):
    """Cycles since the start of a linear or logarithmic chirp from f0 to f1 over ``span`` seconds."""
    x = min(s, span)
    if kind == layout.CHIRP:
        cycles = f0 * x + 0.5 * (f1 - f0) * x * x / span
    else:
        rate = math.log(f1 / f0) / span
        cycles = f0 * x if rate == 0.0 else f0 * math.expm1(rate * x) / rate
    return cycles + f1 * max(s - span, 0.0)


def signal(row, at, tables, k, period):
    """Value at tick k of the signal whose eight numbers begin at ``row[at]``."""
    # kind, amplitude, start time; then frequency and phase (sine, triangle), stop time and first value
    # (ramp), f0, f1 and span (chirps), offset and length in the tables (table: held after its end)
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
        turned = TWO_PI * row[at + 3] * s + row[at + 4]
        return amplitude * (sine(turned) if abs(turned) < LARGEST else math.sin(turned))
    if kind == layout.STEP:
        return amplitude
    if kind == layout.RAMP:
        return row[at + 4] + amplitude * min(s, row[at + 3])
    if kind == layout.TRIANGLE:
        return amplitude * triangle_wave(row[at + 3] * s + row[at + 4] / TWO_PI)
    return amplitude * math.sin(TWO_PI * chirp_cycles(kind, row[at + 3], row[at + 4], row[at + 5], s))


@wide
def fill(row, at, tables, first, count, stride, period, out, to):
    """Sample a signal at ticks first, first + stride, ... of ``count``, into ``out[to]`` and behind."""
    times = int((count + stride - 1) / stride)
    amplitude, turn, phase, begin = row[at + 1], TWO_PI * row[at + 3], row[at + 4], row[at + 2]
    farthest = abs(turn) * (abs(begin) + (first + count) * period) + abs(phase)
    if int(row[at]) == layout.SINE and farthest < LARGEST:
        for n in range(times):
            out[to + n * stride] = amplitude * sine(turn * ((first + n * stride) * period - begin) + phase)
        for n in range(times):
            if (first + n * stride) * period - begin < -1e-9 * period:
                out[to + n * stride] = 0.0
        return
    for n in range(times):
        out[to + n * stride] = signal(row, at, tables, first + n * stride, period)


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


def feed(block, j, io):
    """Hand the inputs beside the command of the j-th tick of a block to the drive."""
    io[layout.IN_LOAD], io[layout.IN_TORQUE] = block[layout.BLOCK_LOAD + j], block[layout.BLOCK_TORQUE + j]
    for point in range(4):
        io[layout.IN_PROBE + point] = block[layout.BLOCK_PROBES + point * layout.BLOCK + j]
