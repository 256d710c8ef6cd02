"""The smallest distance of a factored loop to -1 over intervals that are known, compiled: none overlooked.

What lies nearer than a given distance is a disk in the plane of L: about -1, or about a point beyond. An
interval is done where the range of gain and phase keeps L out of it, or the way in which the squared distance
to the centre bends between the ends; others are halved. The smallest value found is polished by Newton's
method on its slope, and is an end of intervals.
"""

# mypy: disallow-untyped-defs=False
import math

from ._factors import DELAY, EPS, FACTOR, MOST, REAL, WEIGHT, bounded, evaluated, halved, slot
from ._search import DEEPEST, DONE, KNOWN, NARROWEST, half_turns

KERNELS = True

MEETS, UNSETTLED = 3, 4  # status, beside those of the search
FINEST = 1e-8  # relative: how much lower another place may be without being found
SMALL = 1e-6  # nearer to -1 double precision says little
NEWTON_STEPS = 20
NEWTON_STEP = 1e-13


def _distance(form, gain, phase):
    """The quotient of the form at log gain and phase."""
    size = math.exp(gain)
    re, im = size * math.cos(phase), size * math.sin(phase)
    above = math.hypot(form[0] * re + form[1], form[0] * im)
    return above / math.hypot(form[2] * re + form[3], form[2] * im)


def _second(m, factors, parts, at):
    """Second derivative of log L by w in a slot."""
    re, im = 0.0, 0.0
    for k in range(m):
        y, off = parts[at + 4 * k + 2], math.copysign(parts[at + 4 * k + 3], factors[REAL * m + k])
        re += factors[WEIGHT * m + k] * (off * off - y * y)
        im += factors[WEIGHT * m + k] * 2.0 * off * y
    return re, im


def _third(m, factors, parts, left, right):
    """A bound of the third derivative of log L between two slots."""
    total = 0.0
    for k in range(m):
        a, b = left + 4 * k, right + 4 * k
        square = max(
            parts[a + 2] * parts[a + 2] + parts[a + 3] * parts[a + 3],
            parts[b + 2] * parts[b + 2] + parts[b + 3] * parts[b + 3],
        )
        total += abs(factors[WEIGHT * m + k]) * square * math.sqrt(square)
    return 2.0 * total


def _newton(m, factors, form, parts, at):
    """The step of Newton's method on the slope of the squared distance, from a slot.

    With r = a L/(a L + b), q = c L/(c L + e) and l = log L the logarithm of the distance has the slope
    Re((r - q) l') and the curvature Re((r - q) ((1 - r - q) l'^2 + l'')).
    """
    to = at + 4 * m
    size, phase = math.exp(parts[to]), parts[to + 1]
    re, im = size * math.cos(phase), size * math.sin(phase)
    p_re, p_im = form[0] * re + form[1], form[0] * im
    q_re, q_im = form[2] * re + form[3], form[2] * im
    p, q = p_re * p_re + p_im * p_im, q_re * q_re + q_im * q_im
    r_re, r_im = form[0] * (re * p_re + im * p_im) / p, form[0] * (im * p_re - re * p_im) / p
    s_re, s_im = form[2] * (re * q_re + im * q_im) / q, form[2] * (im * q_re - re * q_im) / q
    one_re, one_im = parts[to + 2], parts[to + 3]
    two_re, two_im = _second(m, factors, parts, at)
    t_re, t_im, v_re, v_im = r_re - s_re, r_im - s_im, 1.0 - r_re - s_re, -r_im - s_im
    slope = t_re * one_re - t_im * one_im
    square_re, square_im = one_re * one_re - one_im * one_im, 2.0 * one_re * one_im
    k_re = v_re * square_re - v_im * square_im + two_re
    k_im = v_re * square_im + v_im * square_re + two_im
    curvature = 2.0 * slope * slope + t_re * k_re - t_im * k_im
    w = parts[to + 4]
    step = -slope / curvature if curvature > 0.0 else -math.copysign(0.2 * w, slope)
    return max(min(step, w), -0.5 * w)


def _polished(m, factors, form, start, value, parts, at):
    """The smallest distance next to a place, and where; never farther than there."""
    best, place, w = value, start, start
    for _round in range(NEWTON_STEPS):
        evaluated(m, factors, w, parts, at)
        here = _distance(form, parts[at + 4 * m], parts[at + 4 * m + 1])
        if here < best:
            best, place = here, w
        step = _newton(m, factors, form, parts, at)
        w += step
        if not abs(step) > NEWTON_STEP * w:
            break
    return best, place


def _below(m, factors, form, value, w):
    """(u, v, x): another place is nearer where u abs(L)^2 + v Re L + x < 0, but for rounding of the phase."""
    rounding = 4.0 * EPS * factors[FACTOR * m + DELAY] * w if w < math.inf else 0.0
    less = value * (1.0 - FINEST) - rounding
    square = less * less
    return (
        form[0] * form[0] - square * form[2] * form[2],
        2.0 * (form[0] * form[1] - square * form[2] * form[3]),
        form[1] * form[1] - square * form[3] * form[3],
    )


def _may_reach(u, v, x, least, least_phase, most, most_phase):
    """Whether gain and phase allow f = u abs(L)^2 + v Re L + x < 0."""
    cosine = -1.0
    if half_turns(least_phase) == half_turns(most_phase):
        cosine = min(math.cos(least_phase), math.cos(most_phase))
    low, high = math.exp(least), math.exp(most)
    across = v * cosine
    middle = min(max(-0.5 * across / u, low), high)
    smallest = min((u * low + across) * low, (u * high + across) * high)
    return not min(smallest, (u * middle + across) * middle) + x > 0.0


def _end(m, u, v, x, parts, at):
    """f at a slot, and its slope."""
    to = at + 4 * m
    size, phase = math.exp(parts[to]), parts[to + 1]
    re, im = size * math.cos(phase), size * math.sin(phase)
    slope = 2.0 * u * size * size * parts[to + 2] + v * (re * parts[to + 2] - im * parts[to + 3])
    return u * size * size + v * re + x, slope


def _bends_in(m, factors, u, v, x, parts, left, right, middle):
    """Whether f may fall below zero, by how it bends between two slots, with one in their middle.

    With l = log L and b = v/2, half of its second derivative is
    abs(L)^2 (u abs(l')^2 + Re((u + b/L)* (l'^2 + l''))): what stands there in the middle, less what the third
    derivative of l over the half width may change.
    """
    to = middle + 4 * m
    half = 0.5 * (parts[right + 4 * m + 4] - parts[left + 4 * m + 4])
    size, phase = math.exp(parts[to]), parts[to + 1]
    one_re, one_im = parts[to + 2], parts[to + 3]
    two_re, two_im = _second(m, factors, parts, middle)
    two = half * _third(m, factors, parts, left, right)
    one = half * (math.hypot(two_re, two_im) + two)
    rate = math.hypot(one_re, one_im)
    k_re, k_im = one_re * one_re - one_im * one_im + two_re, 2.0 * one_re * one_im + two_im
    over_re, over_im = 0.5 * v * math.cos(phase) / size, -0.5 * v * math.sin(phase) / size
    k_off = one * (2.0 * rate + one) + two
    grown = half * (rate + one)
    slower = max(rate - one, 0.0)
    bend = min(u * slower * slower, u * (rate + one) * (rate + one))
    bend += (u + over_re) * k_re + over_im * k_im - math.hypot(u + over_re, over_im) * k_off
    bend -= math.hypot(over_re, over_im) * math.expm1(grown) * (math.hypot(k_re, k_im) + k_off)
    bend *= 2.0 * size * size * math.exp(math.copysign(2.0 * grown, -bend))
    first, first_slope = _end(m, u, v, x, parts, left)
    last, last_slope = _end(m, u, v, x, parts, right)
    if not bend > 0.0:  # from each end the way to the middle, no lower than its tangent bent down
        sag = 0.5 * bend * half * half
        inside = min(first + first_slope * half, last - last_slope * half) + sag
        return not min(min(first, last), inside) > 0.0
    down, up = min(first_slope, 0.0), max(last_slope, 0.0)
    return not max(first - down * down / (2.0 * bend), last - up * up / (2.0 * bend)) > 0.0


def _within(m, factors, form, best, parts, bounds):
    """Settle the interval between the first two slots; the status. ``best`` is value and place."""
    size = slot(m)
    depth = 1
    while depth > 0:
        right, middle = size * depth, size * (depth + 1)
        low, high = parts[size - 1], parts[right + size - 1]
        u, v, x = _below(m, factors, form, best[0], best[1])
        bounded(m, factors, parts, 0, right, bounds)
        inside = _may_reach(u, v, x, bounds[0], bounds[1], bounds[MOST], bounds[MOST + 1])
        if inside:
            if depth == DEEPEST or high - low <= NARROWEST * high:
                return UNSETTLED
            cut = low < best[1] and best[1] < high
            at = best[1] if cut else halved(low, high)
            evaluated(m, factors, at, parts, middle)
            if not cut:
                here = _distance(form, parts[middle + 4 * m], parts[middle + 4 * m + 1])
                if here < best[0] * (1.0 - FINEST):
                    value, place = _polished(m, factors, form, at, here, parts, middle + size)
                    best[0], best[1] = value, place
                    if value < SMALL:
                        return MEETS
                elif at == 0.5 * (low + high):
                    inside = _bends_in(m, factors, u, v, x, parts, 0, right, middle)
        if inside:
            depth += 1
        else:
            for k in range(size):
                parts[k] = parts[right + k]
            depth -= 1
    return DONE


def nearest(m, factors, count, known, form, best, parts, bounds):
    """The smallest distance over ``count`` known intervals, if it is less than ``best``; the status."""
    size, given = slot(m), best[0]
    value, place = given, best[1]
    for k in range(count + 1):
        here = _distance(form, known[KNOWN * k + 1], known[KNOWN * k + 2])
        if here < value * (1.0 - FINEST):
            value, place = here, known[KNOWN * k]
    if value < given:
        value, place = _polished(m, factors, form, place, value, parts, 0)
        best[0], best[1] = value, place
    if best[0] < SMALL:
        return MEETS
    for k in range(count):
        at = KNOWN * k
        u, v, x = _below(m, factors, form, best[0], best[1])
        if _may_reach(u, v, x, known[at + 3], known[at + 4], known[at + 5], known[at + 6]):
            evaluated(m, factors, known[at], parts, 0)
            evaluated(m, factors, known[at + KNOWN], parts, size)
            status = _within(m, factors, form, best, parts, bounds)
            if status != DONE:
                return status
    if best[0] < given:  # below 1e-4 the disks of `_below` are not told apart to FINEST
        best[0], best[1] = _polished(m, factors, form, best[1], best[0], parts, 0)
    return DONE
