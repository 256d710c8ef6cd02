"""All figures of many designs of one structure: the loop over designs, compiled."""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import numpy as np

from ._assemble import K_FF, KP_P, N_P, PERIOD, open_loops
from ._compiled import kernel
from ._figures import (
    DC_GAIN,
    FINAL,
    RADIUS,
    STABLE,
    bandwidths,
    crossovers,
    ends,
    modulus,
    resonance,
)
from ._linalg import balance, eigenvalues, hessenberg
from ._response import GAIN, PHASE, evaluate, scan
from ._step import step_figures

LOOPS = 3
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
def _closed_dc(n, h, b, c, system):
    """T at DC: c (I - A + b c)^-1 b by elimination with pivoting (h is A - I)."""
    for i in range(n):
        for j in range(n):
            system[i, j] = -h[i, j] + b[i] * c[j]
        system[i, n] = b[i]
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[best, k]):
                best = i
        if system[best, k] == 0.0:
            return np.nan
        for j in range(k, n + 1):
            system[k, j], system[best, j] = system[best, j], system[k, j]
        for i in range(k + 1, n):
            factor = system[i, k] / system[k, k]
            for j in range(k, n + 1):
                system[i, j] -= factor * system[k, j]
    total = 0.0
    for i in range(n - 1, -1, -1):
        value = system[i, n]
        for j in range(i + 1, n):
            value -= system[i, j] * system[j, n]
        system[i, n] = value / system[i, i]
        total += c[i] * system[i, n]
    return total


@kernel
def _poles(n, a, b, c, closed, scratch, wr, wi):
    """Eigenvalues of a - closed * b c into wr, wi; the largest modulus (nan if the iteration fails).

    An eigenvalue at 1 is not counted: it is the motor angle that an inner loop does not see.
    """
    for i in range(n):
        for j in range(n):
            scratch[i, j] = a[i, j] - closed * b[i] * c[j]
    unused_b = np.zeros(n)
    unused_c = np.zeros(n)
    hessenberg(n, scratch, unused_b, unused_c, np.empty(n))
    if eigenvalues(n, scratch, wr, wi) != 0:
        return np.nan
    radius = 0.0
    for i in range(n):
        if np.hypot(wr[i] - 1.0, wi[i]) > HIDDEN:
            radius = max(radius, np.hypot(wr[i], wi[i]))
    return radius


@kernel
def _one_loop(n, a, b, c, lead, time_figures, arrays, row):
    """Every figure of one open loop into its row."""
    points, stack, xs, rs, ss, work, state, exchanged, scratch, poles = arrays
    row[:] = np.nan
    for k in range(3):
        row[k] = 0.0
    balance(n, a, b, c)
    hessenberg(n, a, b, c, np.empty(n))
    _poles(n, a, b, c, 0.0, scratch, poles[0], poles[1])
    row[RADIUS] = _poles(n, a, b, c, 1.0, scratch, poles[2], poles[3])
    if np.isnan(row[RADIUS]):
        return
    row[STABLE] = 1.0 if row[RADIUS] < 1.0 else 0.0
    for i in range(n):
        a[i, i] -= 1.0
    kept = _grid(n, poles[2], poles[3], poles[0], poles[1], points)
    count = scan(n, a, b, c, points, kept, SMOOTH, stack, xs, rs, ss, work, state, exchanged)
    dc = _closed_dc(n, a, b, c, scratch)
    for i in range(n):
        if np.hypot(poles[2, i] - 1.0, poles[3, i]) <= HIDDEN:
            dc = (rs[0] / (1.0 + rs[0])).real
    row[DC_GAIN] = dc
    row[FINAL] = dc
    open_dc = dc / (1.0 - dc) if abs(1.0 - dc) > 1e-9 else np.inf
    nyquist, _ = evaluate(n, a, b, c, np.pi, work, state, exchanged)
    crossovers(GAIN, count, xs, rs, ss, row, n, a, b, c, work, state, exchanged)
    crossovers(PHASE, count, xs, rs, ss, row, n, a, b, c, work, state, exchanged)
    ends(open_dc, nyquist.real, count, xs, rs, row)
    modulus(count, xs, rs, ss, nyquist, row, n, a, b, c, work, state, exchanged)
    resonance(count, xs, rs, ss, lead, row, n, a, b, c, work, state, exchanged)
    bandwidths(count, xs, rs, ss, dc, lead, row, n, a, b, c, work, state, exchanged)
    if time_figures:
        for i in range(n):
            a[i, i] += 1.0
        step_figures(n, a, b, c, lead, poles[2], poles[3], row)


@kernel
def many_designs(kind, rows, first, last, size, time_figures, out):
    """Fill out[k, loop, :] for designs k in first to last; every design by itself, whatever the split."""
    space = np.zeros((8, size + 1, size + 1))
    a = np.zeros((size, size))
    b = np.zeros(size)
    c = np.zeros(size)
    loops_a = np.zeros((LOOPS, size, size))
    loops_b = np.zeros((LOOPS, size))
    loops_c = np.zeros((LOOPS, size))
    orders = np.zeros(LOOPS, dtype=np.int64)
    arrays = (
        np.empty(600),
        np.empty(48),
        np.empty(CAPACITY),
        np.empty(CAPACITY, dtype=np.complex128),
        np.empty(CAPACITY, dtype=np.complex128),
        np.zeros((size, size), dtype=np.complex128),
        np.zeros(size, dtype=np.complex128),
        np.zeros(size),
        np.zeros((size, size + 1)),
        np.zeros((4, size)),
    )
    for k in range(first, last):
        open_loops(kind, rows[k], space, a, b, c, loops_a, loops_b, loops_c, orders)
        for loop in range(LOOPS):
            if orders[loop] == 0:
                out[k, loop, :] = np.nan
                continue
            lead = 0.0  # feed-forward, in front of the position loop
            if loop == LOOPS - 1:
                lead = rows[k, K_FF] / (rows[k, KP_P] * kind[N_P] * rows[k, PERIOD])
            _one_loop(
                orders[loop], loops_a[loop], loops_b[loop], loops_c[loop], lead, time_figures, arrays,
                out[k, loop],
            )  # fmt: skip
