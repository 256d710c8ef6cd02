"""A stretch of held voltage: slip, landing, stick and breakaway, as often as they come."""

import math

from actuator_lti.compiled.kernel import seldom
from nonlinear._kernels import layout
from nonlinear._kernels.energy import energy_slip, energy_stick, energy_whole
from nonlinear._kernels.slipping import COMPLEX, derivative, first_extremum, slip_at

KERNELS = True

NONE_IN_SEGMENT = -1.0
NEVER_LEFT = -2.0
ITERATIONS = 200


def first_landing(p, s, at, reverse, d, i, w, th, u, T, dt):
    """First time in (0, dt] at which d w falls to zero, which a start at zero is not."""
    # `NEVER_LEFT`: a speed that begins at zero has not become positive by dt (a departure lost in rounding)
    up = d * w > 0.0
    begin = 0.0
    gap = 0.5 * math.pi / p[at + layout.ROOT] if int(p[at + layout.KIND]) == COMPLEX else 0.0
    end = min(first_extremum(p, at, i, w, u, T, 0.0), dt)
    while True:
        if end > 0.0:
            _, w_end, _ = slip_at(p, s, at, reverse, end, i, w, th, u, T)
            if d * w_end > 0.0:
                up = True
            elif up:
                return refine(p, s, at, reverse, d, i, w, th, u, T, begin, end)
        if end >= dt:
            return NONE_IN_SEGMENT if up else NEVER_LEFT
        begin = end
        end = min(first_extremum(p, at, i, w, u, T, begin + gap), dt)


def refine(p, s, at, reverse, d, i, w, th, u, T, begin, end):
    """Root of w in a bracket where s w falls through zero once: Newton inside bisection."""
    low, high = begin, end
    t = 0.5 * (low + high)
    for _ in range(ITERATIONS):
        i_t, w_t, _ = slip_at(p, s, at, reverse, t, i, w, th, u, T)
        if d * w_t > 0.0:
            low = t
        else:
            high = t
        if w_t == 0.0:
            return t
        _, slope = derivative(p, at, i_t, w_t, u, T)
        step = -w_t / slope if slope != 0.0 else 0.0
        following = t + step
        if not (low < following < high):
            following = 0.5 * (low + high)
        if abs(following - t) <= 2.3e-16 * end or high - low <= 2.3e-16 * end:
            return following
        t = following
    return t


def slip_step(p, o, i, w, th, u, T):
    """One precomputed transition."""
    return (
        p[o + layout.A11] * i + p[o + layout.A12] * w + p[o + layout.B1] * u + p[o + layout.C1] * T,
        p[o + layout.A21] * i + p[o + layout.A22] * w + p[o + layout.B2] * u + p[o + layout.C2] * T,
        th + (p[o + layout.A31] * i + p[o + layout.A32] * w + p[o + layout.B3] * u + p[o + layout.C3] * T),
    )


def breakaway_time(p, i, level, u, Tb, dt):
    """Time at which the drive torque of the locked rotor reaches ``level``; also the current then."""
    R, L = p[layout.RESISTANCE], p[layout.INDUCTANCE]
    i_level = (level - Tb) / p[layout.TORQUE_CONSTANT]
    final = u / R
    ratio = (i - final) / (i_level - final)
    t = L / R * math.log(ratio) if ratio > 1.0 else 0.0
    return min(t, dt), i_level


def stick(p, i, u, Tb, Tp, Tm, dt, decay):
    """Locked rotor: time spent, current after it, direction of breakaway (0: none); decay: exp(-R dt/L)."""
    kM, Kg = p[layout.TORQUE_CONSTANT], p[layout.SOURCE_GAIN]
    drive = kM * i + Kg * u + Tb
    if drive > Tp:
        return 0.0, i, 1.0
    if drive < -Tm:
        return 0.0, i, -1.0
    if p[layout.SOURCE] > 0.0:
        return dt, i, 0.0
    final = u * (1.0 / p[layout.RESISTANCE])
    i_end = final + (i - final) * decay
    drive = kM * i_end + Tb
    if drive > Tp:
        t, i_end = breakaway_time(p, i, Tp, u, Tb, dt)
        return t, i_end, 1.0
    if drive < -Tm:
        t, i_end = breakaway_time(p, i, -Tm, u, Tb, dt)
        return t, i_end, -1.0
    return dt, i_end, 0.0


def direction_at_rest(p, i, u, Tb, Tp, Tm, d):
    """What follows a landing of motion d: 0 rest while |drive| <= Tc breakaway, -d motion the other way."""
    drive = p[layout.TORQUE_CONSTANT] * i + p[layout.SOURCE_GAIN] * u + Tb
    if (d > 0.0 and drive < -Tm) or (d < 0.0 and drive > Tp):
        return -d
    return 0.0


def slip_part(p, s, part, left, u, Tb, Tc, i, w, th, d):
    """Slip in direction d up to a landing or the end: time spent, (i, w, th), how it ended (0: landed)."""
    side = 1 if d < 0.0 else 0
    at = layout.MODES + side * layout.MODAL
    T = Tb - d * Tc
    t = NONE_IN_SEGMENT
    if p[layout.SMOOTH] <= 0.0:
        t = first_landing(p, s, at, side, d, i, w, th, u, T, left)
    span = left if t < 0.0 else t
    whole = t < 0.0 and left == p[layout.LENGTH + part]
    if p[layout.WITH_ENERGY] > 0.0:
        if whole:
            energy_whole(p, s, 2 * side + part, i, w, u, T, Tb)
        else:
            energy_slip(p, s, at, side, span, i, w, u, T, Tb)
    if whole:
        i, w, th = slip_step(p, layout.SLIP + (2 * side + part) * layout.TRANSITION, i, w, th, u, T)
    else:
        i, w, th = slip_at(p, s, at, side, span, i, w, th, u, T)
    return span, i, w, th, min(t, 0.0)


@seldom
def segment(p, s, part, u, events):
    """Advance the state row over one segment; returns the events of the tick so far, -1: too many."""
    Tb, Tcp, Tcm = s[layout.S_TORQUE], s[layout.S_DRY], s[layout.S_DRY_REVERSE]
    Tp, Tm = Tcp * p[layout.BREAKAWAY], Tcm * p[layout.BREAKAWAY]
    i, w, th, d = s[layout.S_CURRENT], s[layout.S_SPEED], s[layout.S_ANGLE], s[layout.S_DIRECTION]
    whole = p[layout.LENGTH + part]
    left, here = whole, 0.0
    while left > 0.0 and here <= p[layout.MAX_EVENTS]:
        if d == 0.0:
            decay = p[layout.DECAY + part] if left == whole else math.exp(-p[layout.RELAX] * left)
            t, i_end, d = stick(p, i, u, Tb, Tp, Tm, left, decay)
            if p[layout.WITH_ENERGY] > 0.0:
                energy_stick(p, s, t, i, u)
            i = i_end
            left -= t
            if d != 0.0:
                here += 1.0
            continue
        span, i, w, th, end = slip_part(p, s, part, left, u, Tb, Tcm if d < 0.0 else Tcp, i, w, th, d)
        left -= span
        if end == NEVER_LEFT:
            w, d = 0.0, 0.0
        elif end >= 0.0:
            w = 0.0
            d = direction_at_rest(p, i, u, Tb, Tp, Tm, d)
            here += 1.0
    s[layout.S_CURRENT], s[layout.S_SPEED], s[layout.S_ANGLE], s[layout.S_DIRECTION] = i, w, th, d
    return -1.0 if left > 0.0 else events + here
