"""Step response of a sampled closed loop and its figures, compiled."""

# mypy: disallow-untyped-defs=False
import math

from ._figures import FINAL, HIDDEN, OVERSHOOT, RADIUS, RISE, SETTLING

KERNELS = True

LONGEST = 4_000_000  # ticks
INSIDE = 9.0  # time constants of the slowest pole within the band: what is left is 1e-4 of it
FORGOTTEN = 25.0  # time constants after which the second slowest pole leaves no digit (1e-11)


def step_figures(n, a, b, c, lead, poles, row, state, after):
    """Rise 10-90 % and settling 2 % in ticks, overshoot in percent, of the closed loop a - b c.

    a is in Hessenberg form. Where lead is NaN, of a, b, c as they are.

    All are times of samples; the response is followed until it has stayed within the band for nine time
    constants of the slowest pole, however far above it a resonance was. Where that pole is real and far
    slower than the rest, its tail is known in closed form. A response that would have to be followed for
    longer than `LONGEST` has no overshoot and no settling time here: both stay as they are, NaN.
    """
    radius = row[RADIUS]
    final = row[FINAL]
    if not (radius < 1.0) or not (abs(final) > 0.0):
        return
    inside = max(-INSIDE / math.log(radius), n + 2.0)
    alone = _ticks_until_alone(n, poles, radius)
    tail = alone < min(inside, float(LONGEST))
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
    """Ticks until only the slowest pole is left; infinity where that is no single positive real one."""
    second = 0.0
    slowest = -1
    for i in range(n):
        size = math.hypot(poles[2 * n + i], poles[3 * n + i])
        if size == radius and slowest < 0:
            slowest = i
        elif math.hypot(poles[2 * n + i] - 1.0, poles[3 * n + i]) > HIDDEN:
            second = max(second, size)
    if slowest < 0 or poles[3 * n + slowest] != 0.0 or poles[2 * n + slowest] <= 0.0 or second <= 0.0:
        return math.inf
    return float(math.ceil(-FORGOTTEN / math.log(second))) + n + 2.0


def _ticks_to(rest, level, radius):
    """Ticks until the tail ``|rest| radius^k`` has fallen to a level."""
    if abs(rest) <= level:
        return 0
    return int(math.ceil(math.log(level / abs(rest)) / math.log(radius)))  # noqa: RUF046  (a float in C)
