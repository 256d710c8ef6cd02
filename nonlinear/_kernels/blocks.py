"""Blocks of a controller: sections, PI with anti-windup, own law, measured speed; an instrument, `probe`."""

import math

from nonlinear._kernels import layout

KERNELS = True

CONDITIONAL, CLAMPED, BACK_CALCULATION = range(3)
PROBE_U = layout.PROBES + layout.POINT_VOLTAGE * layout.PROBE_SIZE
PROBE_I = layout.PROBES + layout.POINT_CURRENT * layout.PROBE_SIZE
PROBE_W = layout.PROBES + layout.POINT_SPEED * layout.PROBE_SIZE
PROBE_Y = layout.PROBES + layout.POINT_OUTPUT * layout.PROBE_SIZE
IDEAL, DIFFERENCE, TRACKING = range(3)


def chain(p, at, count, s, to, x):
    """Pass x through sections (direct form II transposed): coefficients from p[at], states from s[to] on."""
    for n in range(count):
        o, q = at + n * layout.SECTION, to + 2 * n
        y = p[o] * x + s[q]
        s[q] = p[o + 1] * x - p[o + 3] * y + s[q + 1]
        s[q + 1] = p[o + 2] * x - p[o + 4] * y
        x = y
    return x


def settle(p, at, count, s, to, x):
    """Set the states of a chain to those of a constant input x; returns its output."""
    for n in range(count):
        o, q = at + n * layout.SECTION, to + 2 * n
        below = 1.0 + p[o + 3] + p[o + 4]
        y = (p[o] + p[o + 1] + p[o + 2]) / below * x if below != 0.0 else 0.0
        s[q + 1] = p[o + 2] * x - p[o + 4] * y
        s[q] = p[o + 1] * x - p[o + 3] * y + s[q + 1]
        x = y
    return x


def clamp(value, limit):
    """Value held within +-limit."""
    return min(max(value, -limit), limit)


def pi(e, integral, gain, step, limit):
    """PI with conditional integration: output, new integral, 1 where the limit acts; ``step`` is Kp T/Tn."""
    updated = integral + step * e
    v = gain * e + updated
    out = clamp(v, limit)
    if out == v:
        return out, updated, 0.0
    if (v > 0.0 and e < 0.0) or (v < 0.0 and e > 0.0):
        return out, updated, 1.0
    return clamp(gain * e + integral, limit), integral, 1.0


def regulator(e, integral, gain, step, extra, limit, law, tracking):
    """`pi` with a feed-forward ``extra`` and any anti-windup law; ``tracking`` is T/Tt."""
    # the limit acts where it clamps the output, and by the law `CLAMPED` where it clamps the integral
    updated = integral + step * e
    kind, held = int(law), 0.0
    if kind == CLAMPED:
        within = clamp(updated, limit)
        held = 0.0 if within == updated else 1.0
        updated = within
    v = gain * e + updated + extra
    out = clamp(v, limit)
    if out == v:
        return out, updated, held
    if kind == CLAMPED:
        return out, updated, 1.0
    if kind == BACK_CALCULATION:
        return out, updated + tracking * (out - v), 1.0
    if (v > 0.0 and e < 0.0) or (v < 0.0 and e > 0.0):
        return out, updated, 1.0
    return clamp(gain * e + integral + extra, limit), integral, 1.0


def probe(p, s, io, point, value):
    """Signal behind the probe at a point: gain times the delayed value plus what is injected."""
    # past values lie in a ring of the state, one for each point
    at = layout.PROBES + point * layout.PROBE_SIZE
    taps = int(p[at + layout.PROBE_TAPS])
    passed = value
    if taps > 0:
        size = int(p[layout.PROBE_RING])
        ring = int(p[layout.AT_PROBES]) + point * size
        place = int(s[layout.S_PROBE_PLACES + point])
        s[ring + place] = value
        s[layout.S_PROBE_PLACES + point] = float(place + 1 if place + 1 < size else 0)
        read = place - int(p[at + layout.PROBE_DELAY])
        if read < 0:
            read += size
        passed = 0.0
        for j in range(taps):
            passed += p[at + layout.PROBE_TAP + j] * s[ring + read]
            read = read - 1 if read > 0 else size - 1
    return p[at + layout.PROBE_GAIN] * passed + io[layout.IN_PROBE + point]


def fill_ring(p, s, point, value):
    """Take every past value at a point as ``value``."""
    size = int(p[layout.PROBE_RING])
    ring = int(p[layout.AT_PROBES]) + point * size
    for j in range(size):
        s[ring + j] = value


def counted(value, scale):
    """Angle as counted: the count below (floor), or the angle itself without an encoder grid."""
    return float(math.floor(value * scale)) / scale if scale > 0.0 else value


def measured_speed(p, s, io, w, th):
    """Speed by the encoder's method, then its first-order filter, then the speed filters."""
    x, angle, source = w, th, int(p[layout.SPEED_SOURCE])
    if p[layout.SPEED_SENSOR] > 0.0:
        x = p[layout.RATIO] * io[layout.IN_OUTPUT_SPEED]
        angle = p[layout.RATIO] * io[layout.IN_OUTPUT]
    at = int(p[layout.AT_ANGLES])  # the last angles, oldest first
    if source == DIFFERENCE:
        seen, m = counted(angle, p[layout.COUNTS_PER_RAD]), int(p[layout.DIFFERENCE_SAMPLES])
        x = (seen - s[at]) / (p[layout.DIFFERENCE_SAMPLES] * p[layout.VELOCITY_PERIOD])
        for j in range(m - 1):
            s[at + j] = s[at + j + 1]
        s[at + m - 1] = seen
    elif source == TRACKING:  # p = th^ + T w^, r = th - p, th^ = p + 2 w0 T r, w^ += w0^2 T r; kept: th^ - th
        x, seen = s[layout.S_TRACKED_SPEED], counted(angle, p[layout.COUNTS_PER_RAD])
        r = (seen - s[at]) - (s[layout.S_TRACKED_ERROR] + p[layout.VELOCITY_PERIOD] * x)
        s[at] = seen
        s[layout.S_TRACKED_ERROR] = (p[layout.TRACKING_ANGLE] - 1.0) * r
        x += p[layout.TRACKING_SPEED] * r
        s[layout.S_TRACKED_SPEED] = x
    filtered = s[layout.S_FILTERED_SPEED]
    filtered += p[layout.FILTER_COEFFICIENT] * (x - filtered)
    s[layout.S_FILTERED_SPEED] = filtered
    return chain(p, layout.SPEED_CHAIN, int(p[layout.SPEED_FILTERS]), s, layout.S_SPEED_CHAIN, filtered)


def own_output(p, s, io, command, error, angle, output):
    """The law's output; leaves its inputs, in the order of `LAW_INPUTS`, in the work space."""
    e, x = int(p[layout.AT_WORK]), int(p[layout.AT_OWN])
    s[e], s[e + 1], s[e + 2] = command, error, s[layout.S_MEASURED_SPEED]
    s[e + 3], s[e + 4] = angle, io[layout.IN_CURRENT]
    s[e + 5], s[e + 6] = output, io[layout.IN_OUTPUT_SPEED]
    v = 0.0
    for j in range(int(p[layout.OWN_STATES])):
        v += p[layout.OWN_C + j] * s[x + j]
    for j in range(layout.OWN_INPUTS):
        v += p[layout.OWN_D + j] * s[e + j]
    return p[layout.OWN_GAIN] * v


def own_states(p, s, excess):
    """Step the states on, after `own_output`; ``excess`` is u - v."""
    n, e, x = int(p[layout.OWN_STATES]), int(p[layout.AT_WORK]), int(p[layout.AT_OWN])
    to = e + layout.OWN_INPUTS
    for k in range(n):
        value = p[layout.OWN_L + k] * excess
        a, b = layout.OWN_A + k * layout.MOST_STATES, layout.OWN_B + k * layout.OWN_INPUTS
        for j in range(n):
            value += p[a + j] * s[x + j]
        for j in range(layout.OWN_INPUTS):
            value += p[b + j] * s[e + j]
        s[to + k] = value
    for k in range(n):
        s[x + k] = s[to + k]
