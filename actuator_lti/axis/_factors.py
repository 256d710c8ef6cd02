"""Gain and phase of a factored loop at one frequency, and their range over an interval, compiled.

Rows are flat. ``factors`` holds `FACTOR` numbers of each root, kind by kind, then those of the loop. What is
known at a frequency fills a slot of ``parts``: gain, turn and their rates of every factor, those of L, and w.
"""

# mypy: disallow-untyped-defs=False
import math

KERNELS = True


REAL, IMAGINARY, OFF_AXIS, WEIGHT, TURNING, FACTOR = range(6)
LOG_GAIN, PHASE, DELAY, SLACK = range(4)
LEAST_RATE, MOST, MOST_RATE, BOUNDS = 2, 4, 6, 8  # places in ``bounds``; least gain and phase come first
STEPS = 60
EPS = 2.220446049250313e-16
STEP = 1e-5  # relative: near enough for the loop itself to go on


def slot(m):
    """Length of a slot."""
    return 4 * m + 5


def evaluated(m, factors, w, parts, at):
    """Fill the slot that begins at ``at``."""
    delay = factors[FACTOR * m + DELAY]
    gain, phase = factors[FACTOR * m + LOG_GAIN], factors[FACTOR * m + PHASE] - delay * w
    gain_rate, phase_rate = 0.0, -delay
    for k in range(m):
        to, weight, turning = at + 4 * k, factors[WEIGHT * m + k], factors[TURNING * m + k]
        y, off = w - factors[IMAGINARY * m + k], factors[OFF_AXIS * m + k]
        size = y * y + off * off
        parts[to] = 0.5 * math.log(size)
        parts[to + 1] = math.atan2(y, off)
        parts[to + 2] = y / size
        parts[to + 3] = off / size
        gain += weight * parts[to]
        phase += turning * parts[to + 1]
        gain_rate += weight * parts[to + 2]
        phase_rate += turning * parts[to + 3]
    to = at + 4 * m
    parts[to], parts[to + 1], parts[to + 2], parts[to + 3], parts[to + 4] = (
        gain, phase, gain_rate, phase_rate, w
    )  # fmt: skip


def _sizes(m, factors, parts, kind, left, right):
    """Sum of the sizes of what makes up a kind at both slots."""
    total = 0.0
    for k in range(m):
        ends = abs(parts[left + 4 * k + kind]) + abs(parts[right + 4 * k + kind])
        total += abs(factors[WEIGHT * m + k]) * ends
    return total


def bounded(m, factors, parts, left, right, bounds):
    """Least and most of log gain, phase and their rates between two slots, between places.

    By what the factors change, each one way; gain and phase by the rate of their sum besides.  Rates are
    widened by their rounding: next to a pole on the axis one is 1e17 times the others.
    """
    a, b = left + 4 * m, right + 4 * m
    width = parts[b + 4] - parts[a + 4]
    for kind in range(4):
        spread = 0.0
        for k in range(m):
            change = parts[right + 4 * k + kind] - parts[left + 4 * k + kind]
            spread += abs(factors[WEIGHT * m + k] * change)
        if kind >= LEAST_RATE:
            spread += EPS * m * _sizes(m, factors, parts, kind, left, right)
        if kind == 1:
            spread += factors[FACTOR * m + DELAY] * width
        middle = parts[a + kind] + parts[b + kind]
        bounds[kind], bounds[MOST + kind] = 0.5 * (middle - spread), 0.5 * (middle + spread)
    for kind in range(2):
        up = max(bounds[MOST_RATE + kind], 0.0) * width
        down = max(-bounds[LEAST_RATE + kind], 0.0) * width
        first, last = parts[a + kind], parts[b + kind]
        bounds[kind] = max(bounds[kind], max(first - down, last - up))
        bounds[MOST + kind] = min(bounds[MOST + kind], min(first + up, last + down))


def one_way(bounds, kind):
    """Whether gain (0) or phase (1) only rises or only falls."""
    return bounds[LEAST_RATE + kind] > 0.0 or bounds[MOST_RATE + kind] < 0.0


def halved(low, high):
    """Where to part an interval."""
    return math.sqrt(low * high) if high > 4.0 * low and low > 0.0 else 0.5 * (low + high)


def root(m, factors, kind, level, parts, left, right, at):
    """Where gain (0) or phase (1), monotone between two slots, takes a level: Newton held by bisection."""
    low, high = parts[left + 4 * m + 4], parts[right + 4 * m + 4]
    first, last = parts[left + 4 * m + kind] - level, parts[right + 4 * m + kind] - level
    w = low + (high - low) * (first / (first - last))
    for _round in range(STEPS):
        evaluated(m, factors, w, parts, at)
        here = parts[at + 4 * m + kind] - level
        if (here > 0.0 and first > 0.0) or (not here > 0.0 and not first > 0.0):
            low = w
        else:
            high = w
        ahead = w - here / parts[at + 4 * m + 2 + kind]
        inside = ahead >= low and ahead <= high
        near = inside and abs(ahead - w) <= STEP * w
        w = ahead if inside else halved(low, high)
        if near:
            break
    return w
