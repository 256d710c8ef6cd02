"""All figures of one loop, and of many loops of one structure, compiled."""

# mypy: disallow-untyped-defs=False
import math

from . import _figures as fig
from ._complex import copied
from ._linalg import balance, hessenberg
from ._resolvent import level_at_dc, rounding_at_dc
from ._response import GAIN, PHASE, response_at, scan
from ._step import step_figures
from ._withheld import rounding_decides

KERNELS = True

TOP = math.pi * (1.0 - 1e-7)  # last scanned angle; Nyquist itself is evaluated apart
LOWEST = 1e-7  # first scanned angle, unless a pole is slower
POINTS = 600  # angles to start from
SMOOTH = 0.05
NO_GAIN = 1e-6  # of the peak of |T|: less at DC (120 dB) is the rounding of a response that is zero there
LOG_10 = 2.302585092994046


def _around_poles(n, poles, low, points, first):
    """Three angles around every lightly damped pole, of the open loop and of the closed one."""
    count = first
    for which in range(2):
        for i in range(n):
            real, imaginary = poles[2 * which * n + i], poles[(2 * which + 1) * n + i]
            angle = abs(math.atan2(imaginary, real))
            width = abs(1.0 - math.hypot(real, imaginary))
            if imaginary <= 0.0 or width > 0.3 * angle:
                continue
            for side in range(3):
                x = angle + (side - 1.0) * width
                if x > low and x < TOP and count < POINTS:
                    points[count] = x
                    count += 1
    return count


def _sorted(points, count):
    """Sort a short row in place (insertion), then drop what is the same but for rounding."""
    for i in range(1, count):
        value = points[i]
        j = i
        while j > 0 and points[max(j - 1, 0)] > value:
            points[j] = points[j - 1]
            j -= 1
        points[j] = value
    kept = 1
    for i in range(1, count):
        if points[i] > points[kept - 1] * (1.0 + 1e-9):
            points[kept] = points[i]
            kept += 1
    return kept


def _grid(n, poles, points):
    """Angles to start from: seven a decade, linear above, and around every lightly damped pole."""
    low = LOWEST
    for i in range(n):
        slow = math.hypot(poles[i] - 1.0, poles[n + i])
        if slow > 1e-11:
            low = min(low, 0.01 * slow)
    decades = math.log(0.3 / low) / LOG_10
    count = int(math.ceil(7.0 * decades))  # noqa: RUF046  (a float in C)
    for i in range(count):
        points[i] = low * math.exp(LOG_10 * decades * (i / count))
    for i in range(16):
        points[count] = 0.3 + (TOP - 0.3) * i / 15.0
        count += 1
    count = _around_poles(n, poles, low, points, count)
    return _sorted(points, count)


def _closed_figures(count, n, a, b, c, lead, dc, row, xs, rs, ss, work, state, exchanged):
    """DC gain, resonance and bandwidths of a closed loop whose response is scanned."""
    row[fig.DC_GAIN], row[fig.FINAL] = dc, dc
    fig.resonance(count, xs, rs, ss, lead, row, n, a, b, c, work, state, exchanged)
    if abs(dc) < NO_GAIN * row[fig.PEAK_T]:  # speed against a spring: no gain to measure a fall from
        row[fig.DC_GAIN], row[fig.FINAL] = math.nan, 0.0
    fig.bandwidths(count, xs, rs, ss, row[fig.DC_GAIN], lead, row, n, a, b, c, work, state, exchanged)


def _open_dc(dc, at_rest):
    """L at DC: infinite for an integrator, else what was found where it fits T, the more exact one.

    Where T is next to nothing there, ``dc`` is NaN: what was found, which is 0 where rounding decides it.
    """
    if math.isnan(dc):
        return at_rest
    if not abs(1.0 - dc) > 1e-9:
        return math.inf
    around = dc / (1.0 - dc)
    return at_rest if abs(at_rest - around) < 1e-3 * abs(around) else around


def _open_figures(count, n, a, b, c, at_rest, row, xs, rs, ss, work, state, exchanged):
    """Crossovers and modulus margin of an open loop whose response is scanned."""
    row[fig.GAIN_CROSSOVERS], row[fig.PHASE_CROSSOVERS] = 0.0, 0.0
    open_dc = _open_dc(row[fig.DC_GAIN], at_rest)
    at_r, at_i = response_at(n, a, b, c, math.pi, work, state, exchanged)
    fig.crossovers(GAIN, count, xs, rs, ss, row, n, a, b, c, work, state, exchanged)
    fig.crossovers(PHASE, count, xs, rs, ss, row, n, a, b, c, work, state, exchanged)
    fig.ends(open_dc, at_r, count, xs, rs, row)
    fig.modulus(count, xs, rs, ss, at_r, at_i, row, n, a, b, c, work, state, exchanged)
    if abs(1.0 + open_dc) < row[fig.MODULUS]:
        row[fig.MODULUS], row[fig.MODULUS_X] = abs(1.0 + open_dc), 0.0


def _radius(n, poles):
    """Largest modulus but of an eigenvalue at 1: the motor angle, which an inner loop does not see."""
    radius = 0.0
    for i in range(n):
        real, imaginary = poles[2 * n + i], poles[3 * n + i]
        if math.hypot(real - 1.0, imaginary) > fig.HIDDEN:
            radius = max(radius, math.hypot(real, imaginary))
    return radius


def one_loop(n, a, b, c, poles, lead, time_figures, row, points, stack, xs, rs, ss, work, state, exchanged):
    """Fill the figures of one open loop; a becomes A - I in Hessenberg form (A itself with time figures).

    poles holds real and imaginary parts of the open loop's, then of the closed loop's. lead is k_ff/(Kv T) of
    a feed-forward in front. Where it is NaN, a, b, c are a closed loop's response itself: then only its
    figures are written. The other rows lend their space: see `many_loops`.
    """
    balance(n, a, b, c)
    at_rest = level_at_dc(n, a, b, c, 0.0, poles, 0, work, exchanged, state)
    if abs(at_rest) < rounding_at_dc(n, a, b, c, work, exchanged, state):
        at_rest = 0.0
    dc = level_at_dc(n, a, b, c, 0.0 if math.isnan(lead) else 1.0, poles, 2 * n, work, exchanged, state)
    hessenberg(n, a, b, c, state)
    for i in range(n):
        a[i * n + i] -= 1.0
    kept = _grid(n, poles, points)
    count = scan(n, a, b, c, points, kept, SMOOTH, stack, xs, rs, ss, work, state, exchanged)
    row[fig.RADIUS] = _radius(n, poles)
    row[fig.STABLE] = 1.0 if row[fig.RADIUS] < 1.0 else 0.0
    _closed_figures(count, n, a, b, c, lead, dc, row, xs, rs, ss, work, state, exchanged)
    if not math.isnan(lead):
        _open_figures(count, n, a, b, c, at_rest, row, xs, rs, ss, work, state, exchanged)
    if time_figures:
        for i in range(n):
            a[i * n + i] += 1.0
        step_figures(n, a, b, c, lead, poles, row, state, work)
    return count


def many_loops(
    count, n, A, B, C, poles, leads, time_figures, out,
    a, b, c, own, row, points, stack, xs, rs, ss, work, state, exchanged,
):  # fmt: skip
    """Fill the k-th row of ``out`` for every open loop by `one_loop`, each by itself.

    The loops lie in A, B, C and poles one after the other; those whose first pole is NaN are left as they
    are, and those whose figures rounding decides have none. The rows behind ``out`` lend their space, see
    `actuator_lti.batch.library`.
    """
    for k in range(count):
        if math.isnan(poles[4 * n * k]):
            continue
        copied(n * n, A, n * n * k, a, 0)
        copied(n, B, n * k, b, 0)
        copied(n, C, n * k, c, 0)
        copied(4 * n, poles, 4 * n * k, own, 0)
        copied(fig.COLUMNS, out, fig.COLUMNS * k, row, 0)
        one_loop(
            n, a, b, c, own, leads[k], time_figures > 0, row,
            points, stack, xs, rs, ss, work, state, exchanged,
        )  # fmt: skip
        copied(n * n, A, n * n * k, a, 0)
        copied(n, B, n * k, b, 0)
        copied(n, C, n * k, c, 0)
        if not math.isnan(leads[k]) and rounding_decides(n, a, b, c, own, row, work, state, exchanged):
            for j in range(fig.COLUMNS):
                row[j] = math.nan
            row[fig.GAIN_CROSSOVERS], row[fig.PHASE_CROSSOVERS] = 0.0, 0.0
        copied(fig.COLUMNS, row, 0, out, fig.COLUMNS * k)
