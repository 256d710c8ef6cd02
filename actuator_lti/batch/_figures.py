"""Margins, bandwidths and peaks of one sampled loop from its scanned response, compiled."""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import numpy as np

from ._compiled import kernel
from ._response import (
    BANDWIDTH,
    GAIN,
    LOST,
    PHASE,
    QUARTER,
    RESONANCE,
    SENSITIVITY,
    closed_loop,
    evaluate,
    quantity,
    root,
)

LISTED = 6  # crossovers of each kind that are kept
# Columns of a row of figures; crossover lists follow at FIRST_GAIN and FIRST_PHASE (pairs x, value).
(
    STABLE,
    GAIN_CROSSOVERS,
    PHASE_CROSSOVERS,
    MODULUS,
    MODULUS_X,
    PEAK_T,
    PEAK_T_X,
    BANDWIDTH_X,
    QUARTER_X,
    DC_GAIN,
    RISE,
    OVERSHOOT,
    SETTLING,
    FINAL,
    RADIUS,
) = range(15)
FIRST_GAIN = 15  # pairs (angle per sample, phase margin in rad within -pi to pi)
FIRST_PHASE = FIRST_GAIN + 2 * LISTED  # pairs (angle per sample, gain margin as ratio)
COLUMNS = FIRST_PHASE + 2 * LISTED


@kernel
def _list(row, counter, first, x, value):
    """Add a crossover to its list; the count goes on past what is kept."""
    k = int(row[counter])
    if k < LISTED:
        row[first + 2 * k] = x
        row[first + 2 * k + 1] = value
    row[counter] = k + 1


@kernel
def _phase_margin(response):
    return np.arctan2(-response.imag, -response.real)


@kernel
def _hidden(mode, k, xs, rs, ss):
    """Whether the cubic through both ends, of one sign, comes near zero between them."""
    f1 = quantity(mode, rs[k], ss[k], 1.0, xs[k], 0.0)
    f2 = quantity(mode, rs[k + 1], ss[k + 1], 1.0, xs[k + 1], 0.0)
    width = xs[k + 1] - xs[k]
    d1 = (ss[k] / rs[k]) * width
    d2 = (ss[k + 1] / rs[k + 1]) * width
    if mode == GAIN:
        s1, s2 = d1.real, d2.real
    else:
        s1 = d1.imag * rs[k].real / abs(rs[k])
        s2 = d2.imag * rs[k + 1].real / abs(rs[k + 1])
    sign = 1.0 if f1 > 0.0 else -1.0
    if not (s1 * sign < 0.0 and s2 * sign > 0.0):
        return False
    lowest = min(f1 * sign, f2 * sign)
    for i in range(1, 16):
        t = i / 16.0
        cubic = (
            f1 * (1 + 2 * t) * (1 - t) ** 2 + s1 * t * (1 - t) ** 2
            + f2 * t * t * (3 - 2 * t) + s2 * t * t * (t - 1)
        )  # fmt: skip
        lowest = min(lowest, cubic * sign)
    return lowest < 0.1


@kernel
def _turning_point(mode, k, xs, rs, ss, n, h, b, c, work, state, exchanged):
    """The angle between two scanned points where the quantity of a mode is extreme, by golden section."""
    shrink = 0.6180339887498949
    low, high = xs[k], xs[k + 1]
    f1 = quantity(mode, rs[k], ss[k], 1.0, xs[k], 0.0)
    sign = 1.0 if f1 > 0.0 else -1.0
    left = high - shrink * (high - low)
    right = low + shrink * (high - low)
    r, s = evaluate(n, h, b, c, left, work, state, exchanged)
    f_left = sign * quantity(mode, r, s, 1.0, 0.0, 0.0)
    r, s = evaluate(n, h, b, c, right, work, state, exchanged)
    f_right = sign * quantity(mode, r, s, 1.0, 0.0, 0.0)
    for _ in range(40):
        if f_left < f_right:
            high, right, f_right = right, left, f_left
            left = high - shrink * (high - low)
            r, s = evaluate(n, h, b, c, left, work, state, exchanged)
            f_left = sign * quantity(mode, r, s, 1.0, 0.0, 0.0)
        else:
            low, left, f_left = left, right, f_right
            right = low + shrink * (high - low)
            r, s = evaluate(n, h, b, c, right, work, state, exchanged)
            f_right = sign * quantity(mode, r, s, 1.0, 0.0, 0.0)
        if min(f_left, f_right) < 0.0:
            break
    return left if f_left < f_right else right


@kernel
def _crossing(mode, x1, f1, x2, f2, row, n, h, b, c, work, state, exchanged):
    """Refine one bracketed gain or phase crossover and list it."""
    x, response = root(mode, 1.0, 0.0, x1, f1, x2, f2, n, h, b, c, work, state, exchanged)
    if mode == GAIN:
        _list(row, GAIN_CROSSOVERS, FIRST_GAIN, x, _phase_margin(response))
    elif response.real < 0.0:
        _list(row, PHASE_CROSSOVERS, FIRST_PHASE, x, -1.0 / response.real)


@kernel
def crossovers(mode, count, xs, rs, ss, row, n, h, b, c, work, state, exchanged):
    """List every gain (or phase) crossover between the scanned points."""
    for k in range(count - 1):
        if ss[k + 1] == 0.0:  # lost in rounding
            continue
        f1 = quantity(mode, rs[k], ss[k], 1.0, xs[k], 0.0)
        f2 = quantity(mode, rs[k + 1], ss[k + 1], 1.0, xs[k + 1], 0.0)
        if (f1 > 0.0) != (f2 > 0.0):
            if mode == PHASE and rs[k].real > 0.0 and rs[k + 1].real > 0.0:
                continue
            _crossing(mode, xs[k], f1, xs[k + 1], f2, row, n, h, b, c, work, state, exchanged)
        elif (mode == GAIN or rs[k].real < 0.0) and _hidden(mode, k, xs, rs, ss):
            x = _turning_point(mode, k, xs, rs, ss, n, h, b, c, work, state, exchanged)
            r, s = evaluate(n, h, b, c, x, work, state, exchanged)
            f = quantity(mode, r, s, 1.0, 0.0, 0.0)
            if (f > 0.0) != (f1 > 0.0):
                _crossing(mode, xs[k], f1, x, f, row, n, h, b, c, work, state, exchanged)
                _crossing(mode, x, f, xs[k + 1], f2, row, n, h, b, c, work, state, exchanged)


@kernel
def ends(response_dc, response_nyquist, count, xs, rs, row):
    """A loop that is negative real at DC or at Nyquist crosses the negative axis there.

    A zero at Nyquist (a two-sample mean) leaves rounding there, no crossing.
    """
    size = 0.0
    for k in range(count):
        if xs[k] > 0.3:
            size = max(size, abs(rs[k]))
    if np.isfinite(response_dc) and response_dc < 0.0:
        _list(row, PHASE_CROSSOVERS, FIRST_PHASE, 0.0, -1.0 / response_dc)
    if response_nyquist < -LOST * size:
        _list(row, PHASE_CROSSOVERS, FIRST_PHASE, np.pi, -1.0 / response_nyquist)


@kernel
def modulus(count, xs, rs, ss, nyquist, row, n, h, b, c, work, state, exchanged):
    """The smallest |1 + L| and where."""
    best = 0
    for k in range(count):
        if abs(1.0 + rs[k]) < abs(1.0 + rs[best]):
            best = k
    row[MODULUS] = abs(1.0 + rs[best])
    row[MODULUS_X] = xs[best]
    if abs(1.0 + nyquist) < row[MODULUS]:
        row[MODULUS] = abs(1.0 + nyquist)
        row[MODULUS_X] = np.pi
    limit = 1.3 * row[MODULUS]
    for k in range(count - 1):
        if min(abs(1.0 + rs[k]), abs(1.0 + rs[k + 1])) > limit:
            continue
        f1 = quantity(SENSITIVITY, rs[k], ss[k], 1.0, xs[k], 0.0)
        f2 = quantity(SENSITIVITY, rs[k + 1], ss[k + 1], 1.0, xs[k + 1], 0.0)
        if f1 < 0.0 and f2 >= 0.0:
            x, r = root(SENSITIVITY, 1.0, 0.0, xs[k], f1, xs[k + 1], f2, n, h, b, c, work, state, exchanged)
            if abs(1.0 + r) < row[MODULUS]:
                row[MODULUS] = abs(1.0 + r)
                row[MODULUS_X] = x


@kernel
def resonance(count, xs, rs, ss, lead, row, n, h, b, c, work, state, exchanged):
    """The largest |T| and where; at the first point where T only falls."""
    best = 0.0
    for k in range(count):
        size = abs(closed_loop(rs[k], xs[k], lead))
        if size > best:
            best = size
            row[PEAK_T_X] = xs[k]
    row[PEAK_T] = best
    for k in range(count - 1):
        f1 = quantity(RESONANCE, rs[k], ss[k], 1.0, xs[k], lead)
        f2 = quantity(RESONANCE, rs[k + 1], ss[k + 1], 1.0, xs[k + 1], lead)
        if not (f1 > 0.0 and f2 <= 0.0):
            continue
        here = abs(closed_loop(rs[k], xs[k], lead))
        if max(here, abs(closed_loop(rs[k + 1], xs[k + 1], lead))) < 0.7 * best:
            continue
        x, r = root(RESONANCE, 1.0, lead, xs[k], f1, xs[k + 1], f2, n, h, b, c, work, state, exchanged)
        size = abs(closed_loop(r, x, lead))
        if size > row[PEAK_T]:
            row[PEAK_T] = size
            row[PEAK_T_X] = x


@kernel
def bandwidths(count, xs, rs, ss, dc, lead, row, n, h, b, c, work, state, exchanged):
    """First fall of |T| below |T(0)|/sqrt 2, and first passage of its phase through -90 degrees."""
    level = abs(dc)
    row[BANDWIDTH_X] = np.nan
    row[QUARTER_X] = np.nan
    if not (level > 0.0):
        return
    for k in range(count - 1):
        f1 = quantity(BANDWIDTH, rs[k], ss[k], level, xs[k], lead)
        f2 = quantity(BANDWIDTH, rs[k + 1], ss[k + 1], level, xs[k + 1], lead)
        if f1 > 0.0 and f2 <= 0.0:
            x, _ = root(BANDWIDTH, level, lead, xs[k], f1, xs[k + 1], f2, n, h, b, c, work, state, exchanged)
            row[BANDWIDTH_X] = x
            break
    for k in range(count - 1):
        f1 = quantity(QUARTER, rs[k], ss[k], level, xs[k], lead)
        f2 = quantity(QUARTER, rs[k + 1], ss[k + 1], level, xs[k + 1], lead)
        closed = closed_loop(rs[k], xs[k], lead)
        if f1 > 0.0 and f2 <= 0.0 and closed.imag < 0.0:
            x, _ = root(QUARTER, level, lead, xs[k], f1, xs[k + 1], f2, n, h, b, c, work, state, exchanged)
            row[QUARTER_X] = x
            break
