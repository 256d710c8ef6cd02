"""Margins, bandwidths and peaks of one sampled loop from its scanned response, compiled."""

# mypy: disallow-untyped-defs=False
import math

from ._complex import distance_at, over, size_at
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
    quantity_at,
    response_at,
    root,
)

KERNELS = True

LISTED = 6  # crossovers of each kind that are kept
FARTHEST = 1e10  # gain margin of 200 dB: what lies beyond, up or down, is not listed
HIDDEN = 1e-10  # distance from 1 within which an eigenvalue is the angle's, which an inner loop does not see
# Columns of a row of figures; crossover lists follow at FIRST_GAIN and FIRST_PHASE (pairs x, value).
(
    STABLE, GAIN_CROSSOVERS, PHASE_CROSSOVERS, MODULUS, MODULUS_X, PEAK_T, PEAK_T_X, BANDWIDTH_X, QUARTER_X,
    DC_GAIN, RISE, OVERSHOOT, SETTLING, FINAL, RADIUS,
) = range(15)  # fmt: skip
FIRST_GAIN = 15  # pairs (angle per sample, phase margin in rad within -pi to pi)
FIRST_PHASE = FIRST_GAIN + 2 * LISTED  # pairs (angle per sample, gain margin as ratio)
COLUMNS = FIRST_PHASE + 2 * LISTED


def _list(row, counter, first, x, value):
    """Add a crossover to its list; the count goes on past what is kept."""
    k = int(row[counter])
    if k < LISTED:
        row[first + 2 * k], row[first + 2 * k + 1] = x, value
    row[counter] = float(k + 1)


def _list_negative(row, x, real):
    """Add a crossing of the negative real axis, where its gain margin lies within 200 dB."""
    if real < -1.0 / FARTHEST and real > -FARTHEST:
        _list(row, PHASE_CROSSOVERS, FIRST_PHASE, x, -1.0 / real)


def _slope_at(mode, k, xs, rs, ss):
    """Derivative of the gain's logarithm, or of the sine of the phase, at a scanned point."""
    gain, turn = over(ss[2 * k], ss[2 * k + 1], rs[2 * k], rs[2 * k + 1])
    return gain if mode == GAIN else turn * rs[2 * k] / size_at(rs, k)


def _hidden(mode, k, f1, f2, xs, rs, ss):
    """Whether the cubic through both ends, of one sign, comes near zero between them."""
    width = xs[k + 1] - xs[k]
    sign = 1.0 if f1 > 0.0 else -1.0
    s1 = width * _slope_at(mode, k, xs, rs, ss)
    if not s1 * sign < 0.0:
        return False
    s2 = width * _slope_at(mode, k + 1, xs, rs, ss)
    if not s2 * sign > 0.0:
        return False
    lowest = min(f1 * sign, f2 * sign)
    for i in range(1, 16):
        t = i / 16.0
        cubic = (
            f1 * (1.0 + 2.0 * t) * (1.0 - t) * (1.0 - t) + s1 * t * (1.0 - t) * (1.0 - t)
            + f2 * t * t * (3.0 - 2.0 * t) + s2 * t * t * (t - 1.0)
        )  # fmt: skip
        lowest = min(lowest, cubic * sign)
    return lowest < 0.1


def _value(mode, x, n, h, b, c, work, state, exchanged):
    """Gain or phase at an angle."""
    rr, ri = response_at(n, h, b, c, x, work, state, exchanged)
    return quantity(mode, rr, ri, 0.0, 0.0, 1.0, 0.0, 0.0)


def _turning_point(mode, k, xs, rs, ss, n, h, b, c, work, state, exchanged):
    """The angle between two scanned points where the quantity of a mode is extreme, by golden section."""
    shrink = 0.6180339887498949
    low, high = xs[k], xs[k + 1]
    sign = 1.0 if quantity_at(mode, k, xs, rs, ss, 1.0, 0.0) > 0.0 else -1.0
    left = high - shrink * (high - low)
    right = low + shrink * (high - low)
    f_left = sign * _value(mode, left, n, h, b, c, work, state, exchanged)
    f_right = sign * _value(mode, right, n, h, b, c, work, state, exchanged)
    for _round in range(40):
        if f_left < f_right:
            high, right, f_right = right, left, f_left
            left = high - shrink * (high - low)
            f_left = sign * _value(mode, left, n, h, b, c, work, state, exchanged)
        else:
            low, left, f_left = left, right, f_right
            right = low + shrink * (high - low)
            f_right = sign * _value(mode, right, n, h, b, c, work, state, exchanged)
        if min(f_left, f_right) < 0.0:
            break
    return left if f_left < f_right else right


def _crossing(mode, x1, f1, x2, f2, row, n, h, b, c, work, state, exchanged):
    """Refine one bracketed gain or phase crossover and list it."""
    x, rr, ri = root(mode, 1.0, 0.0, x1, f1, x2, f2, n, h, b, c, work, state, exchanged)
    if mode == GAIN:
        _list(row, GAIN_CROSSOVERS, FIRST_GAIN, x, math.atan2(-ri, -rr))
    else:
        _list_negative(row, x, rr)


def crossovers(mode, count, xs, rs, ss, row, n, h, b, c, work, state, exchanged):
    """List every gain (or phase) crossover between the scanned points."""
    f2 = quantity_at(mode, 0, xs, rs, ss, 1.0, 0.0)
    for k in range(count - 1):
        f1 = f2
        f2 = quantity_at(mode, k + 1, xs, rs, ss, 1.0, 0.0)
        if ss[2 * k + 2] == 0.0 and ss[2 * k + 3] == 0.0:  # lost in rounding
            continue
        above, after = f1 > 0.0, f2 > 0.0
        if (above and not after) or (after and not above):
            if mode == PHASE and rs[2 * k] > 0.0 and rs[2 * k + 2] > 0.0:
                continue
            _crossing(mode, xs[k], f1, xs[k + 1], f2, row, n, h, b, c, work, state, exchanged)
        elif (mode == GAIN or rs[2 * k] < 0.0) and _hidden(mode, k, f1, f2, xs, rs, ss):
            x = _turning_point(mode, k, xs, rs, ss, n, h, b, c, work, state, exchanged)
            f = _value(mode, x, n, h, b, c, work, state, exchanged)
            if (f > 0.0 and not above) or (above and not f > 0.0):
                _crossing(mode, xs[k], f1, x, f, row, n, h, b, c, work, state, exchanged)
                _crossing(mode, x, f, xs[k + 1], f2, row, n, h, b, c, work, state, exchanged)


def ends(response_dc, response_nyquist, count, xs, rs, row):
    """A loop that is negative real at DC or at Nyquist crosses the negative axis there.

    A zero at Nyquist (a two-sample mean) leaves rounding there, no crossing.
    """
    size = 0.0
    for k in range(count):
        if xs[k] > 0.3:
            size = max(size, size_at(rs, k))
    _list_negative(row, 0.0, response_dc)
    if response_nyquist < -LOST * size:
        _list_negative(row, math.pi, response_nyquist)


def _keep_modulus(size, x, row):
    """Put down |1 + L| at an angle where it is the smallest so far."""
    if size < row[MODULUS]:
        row[MODULUS], row[MODULUS_X] = size, x


def modulus(count, xs, rs, ss, nyquist_r, nyquist_i, row, n, h, b, c, work, state, exchanged):
    """The smallest |1 + L| and where."""
    row[MODULUS], row[MODULUS_X] = distance_at(rs, 0), xs[0]
    for k in range(1, count):
        _keep_modulus(distance_at(rs, k), xs[k], row)
    _keep_modulus(math.hypot(1.0 + nyquist_r, nyquist_i), math.pi, row)
    limit = 1.3 * row[MODULUS]
    after = distance_at(rs, 0)
    for k in range(count - 1):
        before = after
        after = distance_at(rs, k + 1)
        if min(before, after) > limit:
            continue
        f1 = quantity_at(SENSITIVITY, k, xs, rs, ss, 1.0, 0.0)
        f2 = quantity_at(SENSITIVITY, k + 1, xs, rs, ss, 1.0, 0.0)
        steep, width = math.hypot(f1 * before, f2 * after), xs[k + 1] - xs[k]
        # steeper at its ends than a cubic that only rises or only falls (Fritsch, Carlson 1980)
        parts = 8 if f1 * f2 > 0.0 and steep * width > 3.0 * abs(after - before) else 1
        for i in range(1, parts + 1):
            x1, x2 = xs[k] + width * (i - 1) / parts, xs[k] + width * i / parts
            f = f2 if i == parts else _rise(x2, n, h, b, c, work, state, exchanged)
            if f1 < 0.0 and f >= 0.0:
                x, rr, ri = root(SENSITIVITY, 1.0, 0.0, x1, f1, x2, f, n, h, b, c, work, state, exchanged)
                _keep_modulus(math.hypot(1.0 + rr, ri), x, row)
            f1 = f


def _rise(x, n, h, b, c, work, state, exchanged):
    """How |1 + L| rises at an angle, by its sign."""
    rr, ri, slope_r, slope_i = evaluate(n, h, b, c, x, work, state, exchanged)
    return quantity(SENSITIVITY, rr, ri, slope_r, slope_i, 1.0, x, 0.0)


def closed_size(rr, ri, x, lead):
    """|T| of a response."""
    closed_r, closed_i = closed_loop(rr, ri, x, lead)
    return math.hypot(closed_r, closed_i)


def falls_after(after, mode, count, xs, rs, ss, level, lead):
    """The next interval of the scan in which a quantity falls through zero; the last point: there is none."""
    k = after + 1
    f2 = quantity_at(mode, k, xs, rs, ss, level, lead)
    while k < count - 1:
        f1 = f2
        f2 = quantity_at(mode, k + 1, xs, rs, ss, level, lead)
        if f1 > 0.0 and f2 <= 0.0:
            return k
        k += 1
    return k


def zero_in(k, mode, xs, rs, ss, level, lead, n, h, b, c, work, state, exchanged):
    """The angle in an interval of the scan where a quantity is zero, and L there."""
    f1 = quantity_at(mode, k, xs, rs, ss, level, lead)
    f2 = quantity_at(mode, k + 1, xs, rs, ss, level, lead)
    return root(mode, level, lead, xs[k], f1, xs[k + 1], f2, n, h, b, c, work, state, exchanged)


def resonance(count, xs, rs, ss, lead, row, n, h, b, c, work, state, exchanged):
    """The largest |T| and where; at the first point where T only falls."""
    best = 0.0
    for k in range(count):
        size = closed_size(rs[2 * k], rs[2 * k + 1], xs[k], lead)
        if size > best:
            best = size
            row[PEAK_T_X] = xs[k]
    row[PEAK_T] = best
    k = falls_after(-1, RESONANCE, count, xs, rs, ss, 1.0, lead)
    while k < count - 1:
        before = closed_size(rs[2 * k], rs[2 * k + 1], xs[k], lead)
        after = closed_size(rs[2 * k + 2], rs[2 * k + 3], xs[k + 1], lead)
        if not max(before, after) < 0.7 * best:
            x, rr, ri = zero_in(k, RESONANCE, xs, rs, ss, 1.0, lead, n, h, b, c, work, state, exchanged)
            size = closed_size(rr, ri, x, lead)
            if size > row[PEAK_T]:
                row[PEAK_T], row[PEAK_T_X] = size, x
        k = falls_after(k, RESONANCE, count, xs, rs, ss, 1.0, lead)


def bandwidths(count, xs, rs, ss, dc, lead, row, n, h, b, c, work, state, exchanged):
    """First fall of |T| below |T(0)|/sqrt 2, and first passage of the phase of T/T(0) through -90 degrees."""
    row[BANDWIDTH_X], row[QUARTER_X] = math.nan, math.nan
    if not (abs(dc) > 0.0):
        return
    k = falls_after(-1, BANDWIDTH, count, xs, rs, ss, dc, lead)
    if k < count - 1:
        x, _r, _i = zero_in(k, BANDWIDTH, xs, rs, ss, dc, lead, n, h, b, c, work, state, exchanged)
        row[BANDWIDTH_X] = x
    k = falls_after(-1, QUARTER, count, xs, rs, ss, dc, lead)
    while k < count - 1:
        _closed, side = closed_loop(rs[2 * k], rs[2 * k + 1], xs[k], lead)
        if side * dc < 0.0:
            x, _r, _i = zero_in(k, QUARTER, xs, rs, ss, dc, lead, n, h, b, c, work, state, exchanged)
            row[QUARTER_X] = x
            break
        k = falls_after(k, QUARTER, count, xs, rs, ss, dc, lead)
