"""What is kept of a run when its history is not: windows with harmonics, extremes, step figures."""

from __future__ import annotations

import math

from nonlinear._kernels import layout
from nonlinear._kernels.compiled import scalar


@scalar
def clear(out):  # type: ignore[no-untyped-def]
    """Reset a row of results."""
    out[:] = 0.0
    for j in range(4):
        out[layout.OUT_LIMIT_FIRST + j] = -1.0
    for j in range(layout.ALL_SIGNALS):
        out[layout.OUT_EXTREMES + 2 * j] = math.inf
        out[layout.OUT_EXTREMES + 2 * j + 1] = -math.inf
        for w in range(layout.WINDOWS):
            at = layout.OUT_WINDOWS + (w * layout.ALL_SIGNALS + j) * layout.WINDOW_SIGNAL
            out[at + 2], out[at + 3] = math.inf, -math.inf
    for j in (layout.STEP_T10, layout.STEP_T90, layout.STEP_SETTLED):
        out[layout.OUT_STEP + j] = -1.0


@scalar
def extremes(sig, count, out):  # type: ignore[no-untyped-def]
    """Update minimum and maximum of each signal."""
    for j in range(count):
        at = layout.OUT_EXTREMES + 2 * j
        out[at] = min(out[at], sig[j])
        out[at + 1] = max(out[at + 1], sig[j])


@scalar
def window(sig, count, which, harmonics, c, s, out):  # type: ignore[no-untyped-def]
    """Add one tick to a window; (c, s) is the unit phasor of the fundamental."""
    for j in range(count):
        x = sig[j]
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


@scalar
def step_figures(y, y_last, k, band, out):  # type: ignore[no-untyped-def]
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
