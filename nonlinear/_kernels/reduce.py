"""What is kept of a run when its history is not: windows with harmonics, extremes, step figures."""

from __future__ import annotations

import math

import numpy as np

from actuator_lti.compiled.kernel import kernel, seldom
from nonlinear._kernels import layout

LIMITER_BITS = np.array(layout.LIMITER_BITS)


@kernel
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


@kernel
def extremes(io, count, out):
    """Update minimum and maximum of each signal."""
    for j in range(count):
        at = layout.OUT_EXTREMES + 2 * j
        out[at] = min(out[at], io[layout.IO_REFERENCE + j])
        out[at + 1] = max(out[at + 1], io[layout.IO_REFERENCE + j])


@kernel
def window(io, count, which, harmonics, c, s, out):
    """Add one tick to a window; (c, s) is the unit phasor of the fundamental."""
    for j in range(count):
        x = io[layout.IO_REFERENCE + j]
        at = layout.OUT_WINDOWS + (which * layout.ALL_SIGNALS + j) * layout.WINDOW_SIGNAL
        out[at] += x
        out[at + 1] += x * x
        out[at + 2] = min(out[at + 2], x)
        out[at + 3] = max(out[at + 3], x)
        re, im = c, s
        for h in range(harmonics):
            out[at + layout.WINDOW_BASE + 2 * h] += x * re
            out[at + layout.WINDOW_BASE + 2 * h + 1] += x * im
            re, im = re * c - im * s, re * s + im * c


@kernel
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
@kernel
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


@kernel
def windows(p, io, k, count, out):
    """Add tick k to the last window or the one before it."""
    length = int(p[layout.WINDOW])
    into = k - (int(p[layout.TICKS]) - 2 * length)
    if into < 0:
        return
    at = layout.OUT_PHASOR
    if into == 0 or into == length:
        out[at], out[at + 1] = 1.0, 0.0
    c, s = out[at], out[at + 1]
    window(io, count, 1 if into < length else 0, int(p[layout.HARMONICS]), c, s, out)
    out[at], out[at + 1] = c * out[at + 2] - s * out[at + 3], c * out[at + 3] + s * out[at + 2]


@kernel
def reduce(p, io, k, out):
    """Add tick k to whatever is kept of the run."""
    if p[layout.STEP_TARGET] != 0.0:
        y = (io[layout.IO_OUTPUT] - p[layout.ANGLE_START] / p[layout.RATIO]) / p[layout.STEP_TARGET]
        step_figures(y, out[layout.OUT_STEP_BEFORE], k, p[layout.STEP_BAND], out)
        out[layout.OUT_STEP_BEFORE] = y
    count = layout.ALL_SIGNALS if p[layout.PROBING] > 0.0 else layout.BASE_SIGNALS
    if p[layout.WITH_EXTREMES] > 0.0:
        extremes(io, count, out)
    if p[layout.WINDOW] > 0.0:
        windows(p, io, k, count, out)
