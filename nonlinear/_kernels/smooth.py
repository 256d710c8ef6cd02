"""The smoothed friction law Tc tanh(w/w_s), by exponential Runge-Kutta steps of fourth order.

The linear plant and the held voltage are propagated exactly; only the tanh term is approximated (Cox and
Matthews 2002, ETD4RK), so a small inductance costs nothing.  A step h is chosen such that the tolerance
bounds the error of the speed that a tick adds, in smoothing speeds:

    rate h <= STEP_FACTOR (tolerance/bent)^(1/4)  and  rate h <= LONGEST,
    bent Tc/(J w_s) h a min(1, (fastest h)^4/480) <= tolerance.

``rate`` is the relaxation rate Tc/(J w_s) plus the rate |w'|/w_s at which the tanh is run through; ``bent``,
1 - tanh^2, bounds all derivatives of the tanh, one of which is in every term of the error, and grows by
exp(2 rate h) at most within a step.  The last line is what Simpson's rule loses over the fastest motion of
the linear plant, of size a, which the torque follows.  Steps are a segment divided by a power of two.
Beyond SATURATED smoothing speeds tanh is 1 to the last bit but one and a whole segment is exact.

Such a step is exactly the motion of the linear plant under a friction torque that is quadratic in time,
through N(u) at its beginning, (N(a) + N(b))/2 in its middle and N(c) at its end.  The energies are those of
that motion, so they balance to rounding whatever the step.
"""

import math

from nonlinear._kernels import layout
from nonlinear._kernels.energy import NODES, WEIGHTS, add_slip, energy_whole, pieces_of
from nonlinear._kernels.hyperbolic import tanh
from nonlinear._kernels.segment import slip_step
from nonlinear._kernels.slipping import MATRIX, exponential, plant, transition

KERNELS = True

SATURATED = 19.0
STEP_FACTOR = 4.0  # leaves about a factor of twenty to the error seen
LONGEST = 0.5  # rate h of a step
HALF, FULL = 0, layout.TRANSITION
STAGE = 2 * layout.TRANSITION
WEIGHT_1, WEIGHT_2, WEIGHT_3 = STAGE + 3, STAGE + 6, STAGE + 9
FORM_II, FORM_IW, FORM_WW, FORM_NW = 7, 35, 63, 91  # after the seven of i


def phi_columns(p, t, h, work, at):
    """exp of the plant over t, at ``at + MATRIX``; a chain of integrators over h feeds the torque."""
    # column 4 is the response to a unit torque, 5 to the torque t/h, 6 to (t/h)^2/2
    plant(p, layout.FORWARD, t, work, at, layout.TANH_ORDER)
    work[at + 4 * 7 + 5] = t / h
    work[at + 5 * 7 + 6] = t / h
    exponential(work, at, layout.TANH_ORDER)


def prepare_tanh(p, s):
    """Fill the coefficients of every level for both segments, and what chooses among them."""
    p[layout.TANH_PER_SPEED] = 1.0 / p[layout.SMOOTHING]
    p[layout.TANH_RATE] = STEP_FACTOR * math.sqrt(math.sqrt(p[layout.TANH_TOLERANCE]))
    prepare_fastest(p)
    for part in range(2):
        h = p[layout.LENGTH + part]
        if p[layout.SOURCE] <= 0.0:
            share = 1.0 - math.exp(-h * p[layout.RESISTANCE] / p[layout.INDUCTANCE])
            p[layout.TANH_SHARE + part] = share
        for level in range(layout.LEVELS):
            if h > 0.0:
                which = part * layout.LEVELS + level
                prepare_level(p, h, s, layout.TANH + which * layout.LEVEL)
                if p[layout.WITH_ENERGY] > 0.0:
                    prepare_level_forms(p, h, s, layout.TANH_FORMS + which * layout.TANH_FORM)
            h *= 0.5


def prepare_fastest(p):
    """The fastest rate of the linear plant in 1/s, and what part of an acceleration it carries."""
    damping = p[layout.VISCOUS] / p[layout.INERTIA]
    p[layout.TANH_FASTEST], p[layout.TANH_SHAKEN] = damping, 1.0
    if p[layout.SOURCE] <= 0.0:
        tau = p[layout.INDUCTANCE] / p[layout.RESISTANCE]
        square = p[layout.TORQUE_CONSTANT] * p[layout.BACK_EMF] / (p[layout.INERTIA] * p[layout.INDUCTANCE])
        p[layout.TANH_FASTEST] = max(max(1.0 / tau, math.sqrt(square)), damping)
        p[layout.TANH_SHAKEN] = min(1.0, (square + damping * damping) * tau * tau)


def prepare_level(p, h, s, o):
    """Fill the coefficients of one step length at ``p[o]``."""
    at = int(p[layout.AT_WORK])
    transition(p, layout.FORWARD, 0.5 * h, s, at, o + HALF)
    transition(p, layout.FORWARD, h, s, at, o + FULL)
    e = at + MATRIX
    phi_columns(p, 0.5 * h, 0.5 * h, s, at)
    for r in range(3):
        p[o + STAGE + r] = s[e + 7 * r + 4]
    phi_columns(p, h, h, s, at)
    for r in range(3):
        first, second, third = s[e + 7 * r + 4], s[e + 7 * r + 5], s[e + 7 * r + 6]
        p[o + WEIGHT_1 + r] = first - 3.0 * second + 4.0 * third
        p[o + WEIGHT_2 + r] = 2.0 * second - 4.0 * third
        p[o + WEIGHT_3 + r] = 4.0 * third - second


def prepare_level_forms(p, h, s, form):
    """Write the integrals over one step as forms of (i, w, u, T, n0, nm, nc)."""
    for j in range(layout.TANH_FORM):
        p[form + j] = 0.0
    pieces = pieces_of(p, layout.MODES, h)
    length = h / pieces
    for piece in range(pieces):
        for j in range(10):
            add_tanh_node(p, s, (piece + NODES[j]) * length, h, length * WEIGHTS[j], form)


def add_tanh_node(p, s, t, h, weight, form):
    """Add one node of the quadrature to the forms of a step."""
    at = int(p[layout.AT_WORK])
    phi_columns(p, t, h, s, at)
    # i, w and n at t by each of the seven numbers: three rows of seven
    e, rows = at + MATRIX, at + layout.WORK_MORE
    for r in range(2):
        row = e + 7 * r
        first, second, third = s[row + 4], s[row + 5], s[row + 6]
        s[rows + 7 * r], s[rows + 7 * r + 1] = s[row], s[row + 1]
        s[rows + 7 * r + 2], s[rows + 7 * r + 3] = s[row + 3], first
        s[rows + 7 * r + 4] = first - 3.0 * second + 4.0 * third
        s[rows + 7 * r + 5] = 4.0 * second - 8.0 * third
        s[rows + 7 * r + 6] = 4.0 * third - second
    x = t / h
    for j in range(4):
        s[rows + 14 + j] = 0.0
    s[rows + 18] = 1.0 - 3.0 * x + 2.0 * x * x
    s[rows + 19] = 4.0 * x - 4.0 * x * x
    s[rows + 20] = 2.0 * x * x - x
    place = form + 7
    for a in range(7):
        i_a, w_a, n_a = s[rows + a], s[rows + 7 + a], s[rows + 14 + a]
        p[form + a] += weight * i_a
        for b in range(a, 7):
            i_b, w_b, n_b = s[rows + b], s[rows + 7 + b], s[rows + 14 + b]
            half = 0.5 * weight if a == b else weight
            p[place] += half * (i_a * i_b + i_a * i_b)
            p[place + 28] += half * (i_a * w_b + w_a * i_b)
            p[place + 56] += half * (w_a * w_b + w_a * w_b)
            p[place + 84] += half * (n_a * w_b + w_a * n_b)
            place += 1


def form_of_seven(p, at, a, b, c, d, e, f, g):
    """A quadratic form of seven numbers from its 28 coefficients."""
    return (
        a * (p[at] * a + p[at + 1] * b + p[at + 2] * c + p[at + 3] * d
             + p[at + 4] * e + p[at + 5] * f + p[at + 6] * g)
        + b * (p[at + 7] * b + p[at + 8] * c + p[at + 9] * d
             + p[at + 10] * e + p[at + 11] * f + p[at + 12] * g)
        + c * (p[at + 13] * c + p[at + 14] * d + p[at + 15] * e + p[at + 16] * f + p[at + 17] * g)
        + d * (p[at + 18] * d + p[at + 19] * e + p[at + 20] * f + p[at + 21] * g)
        + e * (p[at + 22] * e + p[at + 23] * f + p[at + 24] * g)
        + f * (p[at + 25] * f + p[at + 26] * g)
        + g * g * p[at + 27]
    )  # fmt: skip


def energy_step(p, s, form, angle, i, w, u, Tb, n0, nm, nc):
    """Add the energies of one step under the friction torque (n0, nm, nc); ``angle`` is what it turned."""
    sum_i = p[form] * i + p[form + 1] * w + p[form + 2] * u + p[form + 3] * Tb
    sum_i += p[form + 4] * n0 + p[form + 5] * nm + p[form + 6] * nc
    sum_ii = form_of_seven(p, form + FORM_II, i, w, u, Tb, n0, nm, nc)
    sum_iw = form_of_seven(p, form + FORM_IW, i, w, u, Tb, n0, nm, nc)
    sum_ww = form_of_seven(p, form + FORM_WW, i, w, u, Tb, n0, nm, nc)
    sum_nw = form_of_seven(p, form + FORM_NW, i, w, u, Tb, n0, nm, nc)
    add_slip(p, s, layout.FORWARD, u, Tb, Tb, angle, sum_i, sum_ii, sum_iw, sum_ww)
    s[layout.S_ENERGY + layout.ENERGY_DRY] -= sum_nw


def torque_at(p, w, T, Tcp, Tcm):
    """Torque of friction beyond the forward viscous slope, signed as in the equation; ``T`` is the tanh."""
    if w >= 0.0:
        return -Tcp * T
    return -Tcm * T - (p[layout.VISCOUS_REVERSE] - p[layout.VISCOUS]) * w


def tanh_torque(p, w, Tcp, Tcm):
    """The same from the speed alone."""
    return torque_at(p, w, tanh(w * p[layout.TANH_PER_SPEED]), Tcp, Tcm)


def level_for(p, part, i, w, u, Tb, Tc, T, n0):
    """Number of halvings of a segment that the tolerance asks for at the tanh T, the friction torque n0."""
    if p[layout.TANH_LEVEL] >= 0.0:
        return int(p[layout.TANH_LEVEL])
    per = 1.0 / (p[layout.INERTIA] * p[layout.SMOOTHING])
    drive = p[layout.TORQUE_CONSTANT] * i + p[layout.SOURCE_GAIN] * u + Tb + n0 - p[layout.VISCOUS] * w
    change, h, fastest = abs(drive) * per, p[layout.LENGTH + part], p[layout.TANH_FASTEST]
    viscous = abs(p[layout.VISCOUS_REVERSE] - p[layout.VISCOUS]) / p[layout.INERTIA]
    bent = 1.0 if viscous > 0.0 else 1.0 - T * T
    rate = Tc * per + viscous + change
    shaken = change * p[layout.TANH_SHAKEN]
    if p[layout.SOURCE] <= 0.0:
        # the torque changes within the step as fast as the current does
        missing = (u - p[layout.BACK_EMF] * w) / p[layout.RESISTANCE] - i
        jump = p[layout.TORQUE_CONSTANT] * abs(missing) * per
        rate += jump * p[layout.TANH_SHARE + part]
        shaken += jump * p[layout.RESISTANCE] / (p[layout.INDUCTANCE] * fastest)
    x = fastest * h
    lost = (Tc * per * bent + viscous) * shaken * h * h / (max(x, 1e-300) * p[layout.TANH_TOLERANCE])
    wanted = rate * h * max(math.sqrt(math.sqrt(bent)) / p[layout.TANH_RATE], 1.0 / LONGEST)
    level = 0
    while level < layout.LEVELS - 1 and (wanted > 1.0 or lost * min(1.0, x * x * x * x / 480.0) > 1.0):
        wanted, lost, x = 0.5 * wanted, 0.5 * lost, 0.5 * x
        level += 1
    return level


def etd_step(p, o, i, w, th, u, Tb, Tcp, Tcm, n0):
    """One ETD4RK step from the friction torque n0: state after it, and the torque at its middle and end."""
    ih, wh, thh = slip_step(p, o + HALF, i, w, th, u, Tb)
    ia, wa, tha = ih + p[o + STAGE] * n0, wh + p[o + STAGE + 1] * n0, thh + p[o + STAGE + 2] * n0
    na = tanh_torque(p, wa, Tcp, Tcm)
    nb = tanh_torque(p, wh + p[o + STAGE + 1] * na, Tcp, Tcm)
    _i, wc, _th = slip_step(p, o + HALF, ia, wa, tha, u, Tb)
    nc = tanh_torque(p, wc + p[o + STAGE + 1] * (2.0 * nb - n0), Tcp, Tcm)
    i1, w1, th1 = slip_step(p, o + FULL, i, w, th, u, Tb)
    nab = na + nb
    return (
        i1 + p[o + WEIGHT_1] * n0 + p[o + WEIGHT_2] * nab + p[o + WEIGHT_3] * nc,
        w1 + p[o + WEIGHT_1 + 1] * n0 + p[o + WEIGHT_2 + 1] * nab + p[o + WEIGHT_3 + 1] * nc,
        th1 + p[o + WEIGHT_1 + 2] * n0 + p[o + WEIGHT_2 + 2] * nab + p[o + WEIGHT_3 + 2] * nc,
        0.5 * nab,
        nc,
    )


def saturated(p, s, part, u):
    """Cross a whole segment in one exact step where tanh is 1 all the way; returns 1 where that was so."""
    i, w, far = s[layout.S_CURRENT], s[layout.S_SPEED], SATURATED * p[layout.SMOOTHING]
    if abs(w) <= far or p[layout.TANH_LEVEL] >= 0.0:
        return 0
    sign = 1.0 if w > 0.0 else -1.0
    which = (0 if w > 0.0 else 2) + part
    Tb = s[layout.S_TORQUE]
    T = Tb - sign * (s[layout.S_DRY] if w > 0.0 else s[layout.S_DRY_REVERSE])
    o = layout.SLIP + which * layout.TRANSITION
    i1, w1, th1 = slip_step(p, o, i, w, s[layout.S_ANGLE], u, T)
    if sign * w1 <= far or abs(w1 - w) >= 0.5 * (abs(w) + far):
        return 0
    if p[layout.WITH_ENERGY] > 0.0:
        energy_whole(p, s, which, i, w, u, T, Tb)
    s[layout.S_CURRENT], s[layout.S_SPEED], s[layout.S_ANGLE] = i1, w1, th1
    return 1


def tanh_segment(p, s, part, u):
    """Advance the state row over one segment under the smoothed law."""
    if saturated(p, s, part, u) > 0:
        return
    i, w, th = s[layout.S_CURRENT], s[layout.S_SPEED], s[layout.S_ANGLE]
    Tb, Tcp, Tcm = s[layout.S_TORQUE], s[layout.S_DRY], s[layout.S_DRY_REVERSE]
    whole = p[layout.LENGTH + part]
    done, steps = 0, 1 << (layout.LEVELS - 1)  # in units of the shortest step
    first = part * layout.LEVELS
    bend = abs(Tcp - Tcm) / p[layout.SMOOTHING] + abs(p[layout.VISCOUS_REVERSE] - p[layout.VISCOUS])
    allowed = p[layout.TANH_TOLERANCE] * p[layout.SMOOTHING]
    kink = bend / p[layout.INERTIA] * whole / steps / allowed if p[layout.TANH_LEVEL] < 0.0 else 0.0
    while done < steps:
        T = tanh(w * p[layout.TANH_PER_SPEED])
        n0 = torque_at(p, w, T, Tcp, Tcm)
        level = level_for(p, part, i, w, u, Tb, max(Tcp, Tcm), T, n0)
        unit = steps >> level
        while (done & (unit - 1)) != 0:
            unit >>= 1
            level += 1
        o = layout.TANH + (first + level) * layout.LEVEL
        i1, w1, th1, nm, nc = etd_step(p, o, i, w, th, u, Tb, Tcp, Tcm, n0)
        # unequal friction has a bend at w = 0: a step across it is halved until the bend does not matter
        while kink * abs(w1 - w) * unit > 1.0 and w1 * w < 0.0 and unit > 1:
            unit >>= 1
            level += 1
            o = layout.TANH + (first + level) * layout.LEVEL
            i1, w1, th1, nm, nc = etd_step(p, o, i, w, th, u, Tb, Tcp, Tcm, n0)
        if p[layout.WITH_ENERGY] > 0.0:
            form = layout.TANH_FORMS + (first + level) * layout.TANH_FORM
            energy_step(p, s, form, th1 - th, i, w, u, Tb, n0, nm, nc)
        i, w, th = i1, w1, th1
        done += unit
        s[layout.S_STEPS] += 1.0
    s[layout.S_CURRENT], s[layout.S_SPEED], s[layout.S_ANGLE] = i, w, th
