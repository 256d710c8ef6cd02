"""Frequency response of a small sampled loop and what is read off it, compiled.

A loop is ``L(z) = c (z I - A)^-1 b`` with A in upper Hessenberg form; h is A - I, so that near z = 1
nothing cancels: ``z - 1 = -2 sin(x/2)^2 + j sin x`` at the angle x = w T.  Derivatives are exact.
Rows are flat; complex numbers are pairs (real part, imaginary part), in rows one after the other.
"""

# mypy: disallow-untyped-defs=False
import math

from ._complex import over, times

KERNELS = True

GAIN, PHASE, SENSITIVITY, BANDWIDTH, QUARTER, RESONANCE = range(6)
LOST = 1e-12  # of the largest |L| above 0.3 rad: less is rounding, as of a zero at Nyquist
HALF_LOG_2 = 0.34657359027997264
CAPACITY = 1200  # points of a scanned response
DEEPEST = 48  # halvings on the way to one point


def _exchanged(n, k, h, b, delta_r, delta_i, work, state):
    """One step of the elimination of z I - A where row k + 1, real but for its diagonal, comes first."""
    upper, lower, row = 2 * (k * n + k), 2 * ((k + 1) * n + k), (k + 1) * n + k
    below = -h[row]
    factor_r, factor_i = work[upper] / below, work[upper + 1] / below
    work[upper], work[upper + 1] = below, 0.0
    up_r, up_i = delta_r - h[row + 1], delta_i
    work[lower + 2] = work[upper + 2] - (factor_r * up_r - factor_i * up_i)
    work[lower + 3] = work[upper + 3] - (factor_r * up_i + factor_i * up_r)
    work[upper + 2], work[upper + 3] = up_r, up_i
    for j in range(2, n - k):
        up_r = -h[row + j]
        work[lower + 2 * j] = work[upper + 2 * j] - factor_r * up_r
        work[lower + 2 * j + 1] = work[upper + 2 * j + 1] - factor_i * up_r
        work[upper + 2 * j], work[upper + 2 * j + 1] = up_r, 0.0
    state[2 * k + 2] = state[2 * k] - factor_r * b[k + 1]
    state[2 * k + 3] = state[2 * k + 1] - factor_i * b[k + 1]
    state[2 * k], state[2 * k + 1] = b[k + 1], 0.0
    return factor_r, factor_i


def _in_place(n, k, h, b, delta_r, delta_i, work, state):
    """The same without an exchange: row k + 1 less a multiple of row k."""
    upper, lower, row = 2 * (k * n + k), 2 * ((k + 1) * n + k), (k + 1) * n + k
    factor_r, factor_i = 0.0, 0.0
    if work[upper] != 0.0 or work[upper + 1] != 0.0:
        factor_r, factor_i = over(-h[row], 0.0, work[upper], work[upper + 1])
    for j in range(1, n - k):
        up_r, up_i = work[upper + 2 * j], work[upper + 2 * j + 1]
        work[lower + 2 * j] = -h[row + j] - (factor_r * up_r - factor_i * up_i)
        work[lower + 2 * j + 1] = -(factor_r * up_i + factor_i * up_r)
    up_r, up_i = work[upper + 2], work[upper + 3]
    work[lower + 2] = delta_r - h[row + 1] - (factor_r * up_r - factor_i * up_i)
    work[lower + 3] = delta_i - (factor_r * up_i + factor_i * up_r)
    up_r, up_i = state[2 * k], state[2 * k + 1]
    state[2 * k + 2] = b[k + 1] - (factor_r * up_r - factor_i * up_i)
    state[2 * k + 3] = -(factor_r * up_i + factor_i * up_r)
    return factor_r, factor_i


def _eliminated(n, h, b, x, work, state, exchanged):
    """Bring z I - A to upper triangular form, b along with it; returns z - 1.

    Rows are read from h as they are needed; a row that is still real is multiplied as one.
    """
    sine = math.sin(0.5 * x)
    delta_r, delta_i = -2.0 * sine * sine, math.sin(x)
    for j in range(n):
        work[2 * j], work[2 * j + 1] = -h[j], 0.0
    work[0], work[1] = delta_r - h[0], delta_i
    state[0], state[1] = b[0], 0.0
    for k in range(n - 1):
        upper, lower = 2 * (k * n + k), 2 * ((k + 1) * n + k)
        if abs(h[(k + 1) * n + k]) > abs(work[upper]) + abs(work[upper + 1]):
            factor_r, factor_i = _exchanged(n, k, h, b, delta_r, delta_i, work, state)
            exchanged[k] = 1.0
        else:
            factor_r, factor_i = _in_place(n, k, h, b, delta_r, delta_i, work, state)
            exchanged[k] = 0.0
        work[lower], work[lower + 1] = factor_r, factor_i
    return delta_r, delta_i


def substituted(n, c, work, state):
    """Back substitution in place; returns c times the solution."""
    response_r, response_i = 0.0, 0.0
    i = n - 1
    while i >= 0:
        total_r, total_i = state[2 * i], state[2 * i + 1]
        for j in range(i + 1, n):
            left_r, left_i = work[2 * (i * n + j)], work[2 * (i * n + j) + 1]
            right_r, right_i = state[2 * j], state[2 * j + 1]
            total_r -= left_r * right_r - left_i * right_i
            total_i -= left_r * right_i + left_i * right_r
        total_r, total_i = over(total_r, total_i, work[2 * (i * n + i)], work[2 * (i * n + i) + 1])
        state[2 * i], state[2 * i + 1] = total_r, total_i
        response_r += c[i] * total_r
        response_i += c[i] * total_i
        i -= 1
    return response_r, response_i


def _again(n, c, work, state, exchanged):
    """c (z I - A)^-1 state with the factors that the elimination left behind."""
    carry_r, carry_i = state[0], state[1]
    for k in range(n - 1):
        after_r, after_i = state[2 * k + 2], state[2 * k + 3]
        if exchanged[k] > 0.5:
            kept_r, kept_i = carry_r, carry_i
            carry_r, carry_i = after_r, after_i
            after_r, after_i = kept_r, kept_i
        state[2 * k], state[2 * k + 1] = carry_r, carry_i
        factor_r, factor_i = work[2 * ((k + 1) * n + k)], work[2 * ((k + 1) * n + k) + 1]
        next_r = after_r - (factor_r * carry_r - factor_i * carry_i)
        carry_i = after_i - (factor_r * carry_i + factor_i * carry_r)
        carry_r = next_r
    state[2 * n - 2], state[2 * n - 1] = carry_r, carry_i
    return substituted(n, c, work, state)


def response_at(n, h, b, c, x, work, state, exchanged):
    """L alone at the angle x, with the bits of `evaluate`."""
    _eliminated(n, h, b, x, work, state, exchanged)
    return substituted(n, c, work, state)


def evaluate(n, h, b, c, x, work, state, exchanged):
    """L and dL/dx at the angle x (rad per sample), by Gaussian elimination with row exchanges."""
    delta_r, delta_i = _eliminated(n, h, b, x, work, state, exchanged)
    response_r, response_i = substituted(n, c, work, state)
    again_r, again_i = _again(n, c, work, state, exchanged)
    slope_r, slope_i = times(1.0 + delta_r, delta_i, again_i, -again_r)
    return response_r, response_i, slope_r, slope_i


def closed_loop(response_r, response_i, x, lead):
    """T = L/(1 + L) with the feed-forward in front, ``1 + lead (1 - 1/z)``; lead NaN: the response itself."""
    if math.isnan(lead):
        return response_r, response_i
    closed_r, closed_i = over(response_r, response_i, 1.0 + response_r, response_i)
    if lead != 0.0:
        closed_r, closed_i = times(closed_r, closed_i, 1.0 + lead * (1.0 - math.cos(x)), lead * math.sin(x))
    return closed_r, closed_i


def _resonance(response_r, response_i, slope_r, slope_i, x, lead):
    """d ln|T| / dx."""
    if math.isnan(lead):
        value, _unused = over(slope_r, slope_i, response_r, response_i)
        return value
    below_r, below_i = times(response_r, response_i, 1.0 + response_r, response_i)
    value, _unused = over(slope_r, slope_i, below_r, below_i)
    if lead != 0.0:
        back_r, back_i = math.cos(x), -math.sin(x)
        more, _unused = over(-lead * back_i, lead * back_r, 1.0 + lead * (1.0 - back_r), -lead * back_i)
        value += more
    return value


def quantity(mode, response_r, response_i, slope_r, slope_i, level, x, lead):
    """The function whose zero is looked for, from L and dL/dx at x."""
    if mode == GAIN:
        return math.log(math.hypot(response_r, response_i))
    if mode == PHASE:
        return response_i / math.hypot(response_r, response_i)
    if mode == SENSITIVITY:
        value, _unused = over(slope_r, slope_i, 1.0 + response_r, response_i)
        return value
    if mode == RESONANCE:
        return _resonance(response_r, response_i, slope_r, slope_i, x, lead)
    closed_r, closed_i = closed_loop(response_r, response_i, x, lead)
    size = math.hypot(closed_r, closed_i)
    if mode == BANDWIDTH:
        return math.log(size / abs(level)) + HALF_LOG_2
    return closed_r / math.copysign(size, level)  # QUARTER


def quantity_at(mode, k, xs, rs, ss, level, lead):
    """The same at a scanned point."""
    return quantity(mode, rs[2 * k], rs[2 * k + 1], ss[2 * k], ss[2 * k + 1], level, xs[k], lead)


def root(mode, level, lead, begin_x, begin_f, end_x, end_f, n, h, b, c, work, state, exchanged):
    """The zero between two angles (signs differ), to rounding (Chandrupatla 1997), and L there."""
    x1, f1, x2, f2 = begin_x, begin_f, end_x, end_f
    x3, f3 = begin_x, begin_f
    t = 0.5
    response_r, response_i = 0.0, 0.0
    x = begin_x
    for _round in range(80):
        x = x1 + t * (x2 - x1)
        slope_r, slope_i = 0.0, 0.0  # asked for by two modes alone
        if mode == SENSITIVITY or mode == RESONANCE:  # noqa: SIM109  (no tuples in C)
            response_r, response_i, slope_r, slope_i = evaluate(n, h, b, c, x, work, state, exchanged)
        else:
            response_r, response_i = response_at(n, h, b, c, x, work, state, exchanged)
        f = quantity(mode, response_r, response_i, slope_r, slope_i, level, x, lead)
        if (f > 0.0 and f1 > 0.0) or (not f > 0.0 and not f1 > 0.0):
            x3, f3 = x1, f1
        else:
            x3, f3 = x2, f2
            x2, f2 = x1, f1
        x1, f1 = x, f
        best_x = x2 if abs(f2) < abs(f1) else x1
        tolerance = 4e-16 * abs(best_x)
        if f == 0.0 or abs(x2 - x1) <= 4.0 * tolerance:
            break
        share = tolerance / abs(x2 - x1)
        xi = (x1 - x2) / (x3 - x2)
        phi = (f1 - f2) / (f3 - f2)
        if phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi:
            t = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
        else:
            t = 0.5
        t = min(max(t, share), 1.0 - share)
    return x, response_r, response_i


def _keep(k, x, response_r, response_i, slope_r, slope_i, xs, rs, ss):
    xs[k] = x
    rs[2 * k], rs[2 * k + 1] = response_r, response_i
    ss[2 * k], ss[2 * k + 1] = slope_r, slope_i


def _smooth(width, growth, turned, before_r, before_i, here_r, here_i, tolerance):
    """Whether log L is a cubic between two points, from its change and from its derivatives at both."""
    predicted_r, predicted_i = 0.5 * width * (here_r + before_r), 0.5 * width * (here_i + before_i)
    turn = turned - predicted_i
    turn -= 2.0 * math.pi * float(math.floor(turn / (2.0 * math.pi) + 0.5))
    return abs(growth - predicted_r) + abs(turn) < tolerance and abs(predicted_i) < 1.0


def scan(n, h, b, c, grid, points, tolerance, stack, xs, rs, ss, work, state, exchanged):
    """Responses on a grid of angles, refined until log L is a cubic between neighbours; return the count.

    An interval is halved until the change of log L over it meets the trapezoidal rule on its exact
    derivative to ``tolerance`` (nepers and radians), so that no half turn or resonance hides inside. Where L
    is lost in rounding (next to a multiple zero at Nyquist) nothing is refined, its slope is put down as 0.
    """
    response_r, response_i, slope_r, slope_i = evaluate(n, h, b, c, grid[0], work, state, exchanged)
    _keep(0, grid[0], response_r, response_i, slope_r, slope_i, xs, rs, ss)
    before_r, before_i = over(slope_r, slope_i, response_r, response_i)
    level, angle = math.log(math.hypot(response_r, response_i)), math.atan2(response_i, response_r)
    count = 1
    largest = 0.0
    for g in range(1, points):
        stack[0] = grid[g]
        depth = 1
        while depth > 0:
            x = stack[depth - 1]
            response_r, response_i, slope_r, slope_i = evaluate(n, h, b, c, x, work, state, exchanged)
            size = math.hypot(response_r, response_i)
            if x > 0.3:
                largest = max(largest, size)
            lost = size < LOST * largest
            if lost:
                slope_r, slope_i = 0.0, 0.0
            left = count - 1
            width = x - xs[left]
            here_r, here_i = over(slope_r, slope_i, response_r, response_i)
            level_here, angle_here = math.log(size), math.atan2(response_i, response_r)
            growth, turned = level_here - level, angle_here - angle
            smooth = _smooth(width, growth, turned, before_r, before_i, here_r, here_i, tolerance)
            room = depth < DEEPEST and count + depth + points - g < CAPACITY - 2
            still = slope_r == 0.0 and slope_i == 0.0
            if smooth or still or not room or width < 1e-12 * x:
                _keep(count, x, response_r, response_i, slope_r, slope_i, xs, rs, ss)
                before_r, before_i, level, angle = here_r, here_i, level_here, angle_here
                count += 1
                depth -= 1
            else:
                stack[depth] = xs[left] + 0.5 * width if x < 3.0 * xs[left] else math.sqrt(xs[left] * x)
                depth += 1
    return count
