"""All figures of many loops of one structure: the loop over designs, compiled."""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import numpy as np

from ._compiled import kernel
from ._figures import (
    DC_GAIN,
    FINAL,
    GAIN_CROSSOVERS,
    PHASE_CROSSOVERS,
    RADIUS,
    STABLE,
    bandwidths,
    crossovers,
    ends,
    modulus,
    resonance,
)
from ._linalg import balance, hessenberg
from ._response import GAIN, PHASE, closed_loop, evaluate, scan
from ._step import step_figures

TOP = np.pi * (1.0 - 1e-7)  # last scanned angle; Nyquist itself is evaluated apart
LOWEST = 1e-7  # first scanned angle, unless a pole is slower
CAPACITY = 1200
SMOOTH = 0.05
HIDDEN = 1e-10  # distance from 1 within which an eigenvalue is the angle's


@kernel
def _grid(n, wr, wi, open_wr, open_wi, points):
    """Angles to start from: seven a decade, linear above, and around every lightly damped pole."""
    low = LOWEST
    for i in range(n):
        slow = np.hypot(open_wr[i] - 1.0, open_wi[i])
        if slow > 1e-11:
            low = min(low, 0.01 * slow)
    count = int(np.ceil(7.0 * np.log10(0.3 / low)))
    for i in range(count):
        points[i] = low * (0.3 / low) ** (i / count)
    for i in range(16):
        points[count] = 0.3 + (TOP - 0.3) * i / 15.0
        count += 1
    for which in range(2):
        for i in range(n):
            re = open_wr[i] if which == 0 else wr[i]
            im = open_wi[i] if which == 0 else wi[i]
            size = np.hypot(re, im)
            angle = abs(np.arctan2(im, re))
            width = abs(1.0 - size)
            if im <= 0.0 or width > 0.3 * angle or angle > 0.99 * np.pi:
                continue
            for side in range(-1, 2):
                x = angle + side * width
                if low < x < TOP and count < points.size:
                    points[count] = x
                    count += 1
    ordered = np.sort(points[:count])
    kept = 1
    points[0] = ordered[0]
    for i in range(1, count):
        if ordered[i] > points[kept - 1] * (1.0 + 1e-9):
            points[kept] = ordered[i]
            kept += 1
    return kept


@kernel
def _closed_dc(n, h, b, c, closed):
    """T at DC: c (I - A + closed b c)^-1 b (h is A - I); nan where that is singular."""
    system = np.empty((n, n))
    right = np.empty(n)
    for i in range(n):
        right[i] = b[i]
        for j in range(n):
            system[i, j] = -h[i, j] + closed * b[i] * c[j]
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[best, k]):
                best = i
        if system[best, k] == 0.0:
            return np.nan
        right[k], right[best] = right[best], right[k]
        for j in range(k, n):
            system[k, j], system[best, j] = system[best, j], system[k, j]
        for i in range(k + 1, n):
            factor = system[i, k] / system[k, k]
            right[i] -= factor * right[k]
            for j in range(k, n):
                system[i, j] -= factor * system[k, j]
    total = 0.0
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            right[i] -= system[i, j] * right[j]
        right[i] /= system[i, i]
        total += c[i] * right[i]
    return total


@kernel
def _scanned(n, a, b, c, poles, scratch, arrays):
    """The scanned response of a loop; a becomes a - I in Hessenberg form. The count of points."""
    points, stack = scratch
    xs, rs, ss, work, state, exchanged = arrays
    balance(n, a, b, c)
    hessenberg(n, a, b, c, np.empty(n))
    for i in range(n):
        a[i, i] -= 1.0
    kept = _grid(n, poles[2], poles[3], poles[0], poles[1], points)
    return scan(n, a, b, c, points, kept, SMOOTH, stack, xs, rs, ss, work, state, exchanged)


@kernel
def _closed_figures(count, n, a, b, c, lead, poles, arrays, row):
    """DC gain, resonance and bandwidths of a closed loop whose response is scanned."""
    xs, rs, ss, work, state, exchanged = arrays
    dc = _closed_dc(n, a, b, c, 0.0 if np.isnan(lead) else 1.0)
    for i in range(n):
        if np.hypot(poles[2, i] - 1.0, poles[3, i]) <= HIDDEN:
            dc = closed_loop(rs[0], xs[0], np.nan if np.isnan(lead) else 0.0).real
    row[DC_GAIN] = dc
    row[FINAL] = dc
    resonance(count, xs, rs, ss, lead, row, n, a, b, c, work, state, exchanged)
    bandwidths(count, xs, rs, ss, dc, lead, row, n, a, b, c, work, state, exchanged)


@kernel
def _one_loop(count, n, a, b, c, arrays, row):
    """Crossovers and modulus margin of an open loop whose response is scanned."""
    xs, rs, ss, work, state, exchanged = arrays
    for k in (GAIN_CROSSOVERS, PHASE_CROSSOVERS):
        row[k] = 0.0
    dc = row[DC_GAIN]
    open_dc = dc / (1.0 - dc) if abs(1.0 - dc) > 1e-9 else np.inf
    nyquist, _ = evaluate(n, a, b, c, np.pi, work, state, exchanged)
    crossovers(GAIN, count, xs, rs, ss, row, n, a, b, c, work, state, exchanged)
    crossovers(PHASE, count, xs, rs, ss, row, n, a, b, c, work, state, exchanged)
    ends(open_dc, nyquist.real, count, xs, rs, row)
    modulus(count, xs, rs, ss, nyquist, row, n, a, b, c, work, state, exchanged)


@kernel
def _radius(n, wr, wi):
    """Largest modulus but of an eigenvalue at 1: the motor angle, which an inner loop does not see."""
    radius = 0.0
    for i in range(n):
        if np.hypot(wr[i] - 1.0, wi[i]) > HIDDEN:
            radius = max(radius, np.hypot(wr[i], wi[i]))
    return radius


@kernel
def many_loops(A, B, C, poles, lead, time_figures, out):
    """Fill out[k] for every open loop A[k], B[k], C[k] (overwritten); every design by itself.

    poles[k] holds real and imaginary parts of the open loop's, then of the closed loop's. lead is k_ff/(Kv
    T) of a feed-forward in front. Where it is NaN, A, B, C are a closed loop's response itself: then only
    its figures are written.
    """
    n = A.shape[1]
    scratch = (np.empty(600), np.empty(48))
    arrays = (
        np.empty(CAPACITY),
        np.empty(CAPACITY, dtype=np.complex128),
        np.empty(CAPACITY, dtype=np.complex128),
        np.zeros((n, n), dtype=np.complex128),
        np.zeros(n, dtype=np.complex128),
        np.zeros(n),
    )
    for k in range(A.shape[0]):
        a, b, c, row = A[k], B[k], C[k], out[k]
        if np.isnan(poles[k, 0, 0]):
            continue
        count = _scanned(n, a, b, c, poles[k], scratch, arrays)
        row[RADIUS] = _radius(n, poles[k, 2], poles[k, 3])
        row[STABLE] = 1.0 if row[RADIUS] < 1.0 else 0.0
        _closed_figures(count, n, a, b, c, lead[k], poles[k], arrays, row)
        if not np.isnan(lead[k]):
            _one_loop(count, n, a, b, c, arrays, row)
        if time_figures:
            for i in range(n):
                a[i, i] += 1.0
            step_figures(n, a, b, c, lead[k], poles[k, 2], poles[k, 3], row)
