"""Step response of a sampled closed loop and its figures, compiled."""

# mypy: disallow-untyped-defs=False
import math

from ._figures import FINAL, HIDDEN, OVERSHOOT, RADIUS, RISE, SETTLING

KERNELS = True

LONGEST = 4_000_000  # ticks
INSIDE = 9.0  # time constants of the slowest pole within the band: what is left is 1e-4 of it
FORGOTTEN = 25.0  # time constants after which the second slowest pole leaves no digit (1e-11)
EQUAL = 1e-9  # of its size: as slow as the slowest pole


def step_figures(n, a, b, c, lead, poles, row, state, after):
    """Rise 10-90 % and settling 2 % in ticks, overshoot in percent, of the closed loop a - b c.

    a is in Hessenberg form. Where lead is NaN, of a, b, c as they are.

    All are times of samples; the response is followed until it has stayed within the band for nine time
    constants of the slowest pole, however far above it a resonance was. Where that pole is real and far
    slower than the rest, its tail is known in closed form; where a pair of poles is, two samples tell how
    large it can still be, and where all M-th roots of a number are, as in a periodic drive, the last M do. A
    response that would have to be followed for longer than `LONGEST` has no overshoot and no settling time
    here: both stay as they are, NaN.
    """
    radius = row[RADIUS]
    final = row[FINAL]
    if not (radius < 1.0) or not (abs(final) > 0.0):
        return
    inside = max(-INSIDE / math.log(radius), n + 2.0)
    alone = _ticks_until_alone(n, poles, radius)
    slowest = _slowest(n, poles, radius)
    real = poles[2 * n + slowest]
    imaginary = poles[3 * n + slowest]
    turn = _turn(n, poles, radius)
    tail = turn == 1.0 and imaginary == 0.0 and alone < min(inside, float(LONGEST))
    look = max(alone, turn)  # never where others than these are left
    above = 0.0
    off = 1.0
    ticks = int(alone) if tail else LONGEST
    fed_back = 0.0 if math.isnan(lead) else 1.0
    for i in range(n):
        state[i] = 0.0
    ten = -1
    ninety = -1
    highest = 0.0
    outside = 0
    y = 0.0
    k = 0
    while k < ticks and (tail or k - outside < inside):
        k += 1
        total = 0.0
        for j in range(n):
            total += c[j] * state[j]
        error = 1.0 - fed_back * total
        if k == 1 and lead > 0.0:
            error += lead  # the command has jumped since the sample before
        for i in range(n):
            value = b[i] * error
            for j in range(max(i - 1, 0), n):
                value += a[i * n + j] * state[j]
            after[i] = value
        before = y - 1.0
        y = 0.0
        for j in range(n):
            state[j] = after[j]
            y += c[j] * after[j]
        y /= final
        if ten < 0 and y >= 0.1:
            ten = k
        if ninety < 0 and y >= 0.9:
            ninety = k
        highest = max(highest, y)
        if abs(y - 1.0) > 0.02:
            outside = k
        above = max(above, y - 1.0)
        off = max(off, abs(y - 1.0))
        if k >= look:
            if imaginary != 0.0:  # of w p^k and its conjugate
                off = math.hypot(before, (real * before - (y - 1.0)) / imaginary)
                above = off
            if off <= 0.02 and above <= max(highest - 1.0, 1e-9):
                inside = 0.0  # what follows is smaller
            look = k + turn
            above = -1.0
            off = 0.0
    if tail:
        rest = y - 1.0
        if ten < 0:
            ten = ticks + _ticks_to(rest, 0.9, radius)
        if ninety < 0:
            ninety = ticks + _ticks_to(rest, 0.1, radius)
        if abs(rest) > 0.02:
            outside = ticks + _ticks_to(rest, 0.02, radius) - 1
    row[RISE] = float(ninety - ten) if ninety >= 0 else math.nan
    if not tail and k - outside < inside:
        return
    row[OVERSHOOT] = 100.0 * (highest - 1.0) if highest > 1.0 + 1e-9 else 0.0
    row[SETTLING] = outside + 1.0


def _ticks_until_alone(n, poles, radius):
    """Ticks until only the slowest poles are left."""
    second = 0.0
    for i in range(n):
        size = math.hypot(poles[2 * n + i], poles[3 * n + i])
        if size < radius * (1.0 - EQUAL):
            second = max(second, size)
    if second <= 0.0:
        return math.inf
    return float(math.ceil(-FORGOTTEN / math.log(second))) + n + 2.0


def _slowest(n, poles, radius):
    """Which pole is the slowest, the real one before others."""
    found = 0
    for i in range(n):
        if _is_slowest(poles[2 * n + i], poles[3 * n + i], radius):
            found = i
            if poles[3 * n + i] == 0.0 and poles[2 * n + i] > 0.0:
                return i
    return found


def _turn(n, poles, radius):
    """Ticks until the slowest poles have the same signs again, infinity of others than these.

    M of the M-th roots of a positive real one, 1 of itself and of a pair, whose angle is looked at.
    """
    count = 0
    turned = 0.0
    for i in range(n):
        if _is_slowest(poles[2 * n + i], poles[3 * n + i], radius):
            count += 1
    first = _slowest(n, poles, radius)
    if poles[3 * n + first] != 0.0:
        return 1.0 if count == 2 else math.inf
    if poles[2 * n + first] < 0.0:
        return math.inf
    for i in range(n):
        if _is_slowest(poles[2 * n + i], poles[3 * n + i], radius):
            turns = math.atan2(poles[3 * n + i], poles[2 * n + i]) * count / (2.0 * math.pi)
            turned = max(turned, abs(turns - math.floor(turns + 0.5)))
    return float(count) if turned < 1e-6 else math.inf


def _is_slowest(real, imaginary, radius):
    """Whether a pole is one of the slowest; that of an angle, which an inner loop does not see, is none."""
    size = math.hypot(real, imaginary)
    return math.hypot(real - 1.0, imaginary) > HIDDEN and abs(size - radius) <= EQUAL * radius


def _ticks_to(rest, level, radius):
    """Ticks until the tail ``|rest| radius^k`` has fallen to a level."""
    if abs(rest) <= level:
        return 0
    return int(math.ceil(math.log(level / abs(rest)) / math.log(radius)))  # noqa: RUF046  (a float in C)
