"""The event-driven, piecewise-affine plant of model.md section 6: one held segment with all its events.

A whole segment is one precomputed transition wherever a bound shows that no guard can cross in it.  Otherwise
the segment is walked: by precomputed dyadic steps where the plant is stiff, and by Taylor series over short
intervals, in which the first fall of a guard is located to rounding.

Energies over a piece of one mode: Gauss-Legendre of ten points on the Taylor series, exact to rounding on an
interval that is short against every mode.  Only the losses of friction, of the coupling's damping and of
parting are dissipation, and none of them falls.
"""

import math

from actuator_lti.compiled.kernel import seldom
from nonlinear._kernels import elastic_layout as at
from nonlinear._kernels import elastic_modes as modes
from nonlinear._kernels import elastic_series as series
from nonlinear._kernels import layout
from nonlinear._kernels.energy import NODES, WEIGHTS

KERNELS = True

FINITE = 1e15
LARGEST = 1e300
SURE = 1.001  # rounding does not decide what a bound allows


def add_energies(p, s, h):
    """Add the energies over the first h of the interval whose series is filled."""
    for j in range(NODES.shape[0]):
        i, w, W, d, _turned = series.series_state(p, s, h * NODES[j])
        add_powers(p, s, h * WEIGHTS[j], i, w, W, d)


def add_powers(p, s, weight, i, w, W, d):
    """Add weight times the power of every line in one state."""
    e = layout.S_ENERGY
    u = s[at.ES_INPUT + at.IN_U]
    if p[layout.SOURCE] > 0.0:
        s[e + layout.ENERGY_INPUT] += weight * p[layout.SOURCE_GAIN] * u * w
    else:
        s[e + layout.ENERGY_INPUT] += weight * u * i
        s[e + layout.ENERGY_COPPER] += weight * p[layout.RESISTANCE] * i * i
        s[e + layout.ENERGY_CONVERSION] += weight * (p[layout.BACK_EMF] - p[layout.TORQUE_CONSTANT]) * i * w
    side = modes.contact_side(s)
    rate = w / p[layout.RATIO_TO_COUPLING] - W
    torque = 0.0
    if side != 0.0:
        k, rest = modes.spring_of(p, s, side)
        torque = k * (d - rest) + p[layout.COUPLING_DAMPING] * rate
        s[e + layout.ENERGY_DAMPING] += weight * p[layout.COUPLING_DAMPING] * rate * rate
    parted = 0.5 * s[at.ES_CONTACT]
    if abs(parted) == 1.0:
        k, rest = modes.spring_of(p, s, parted)
        s[e + layout.ENERGY_PARTING] -= weight * k * (d - rest) * rate
    add_motor_friction(p, s, weight, w, torque)
    s[e + layout.ENERGY_LOAD_DRY] += weight * p[layout.LOAD_DRY] * s[at.ES_LOAD] * W
    s[e + layout.ENERGY_LOAD_VISCOUS] += weight * p[layout.LOAD_VISCOUS] * W * W
    s[e + layout.ENERGY_LOAD_OFFSET] += weight * p[layout.LOAD_OFFSET] * W
    outside = p[at.EL_BACK] * s[at.ES_INPUT + at.IN_M] + s[at.ES_INPUT + at.IN_EXTRA]
    outside_load = s[at.ES_INPUT + at.IN_M] / p[at.EL_RATIO_BEHIND]
    s[e + layout.ENERGY_LOAD] -= weight * (outside * w + outside_load * W)


def add_motor_friction(p, s, weight, w, torque):
    """Motor friction; a self-locking stage keeps what it does not hand on to the coupling."""
    e, direction, place = layout.S_ENERGY, s[layout.S_DIRECTION], modes.map_place(p, s)
    level, slope = p[place + at.MAP_LEVEL], p[place + at.MAP_SLOPE]
    dry = (
        direction * (level + p[at.EL_LOAD_COEFFICIENT] * abs(torque))
        - s[at.ES_MOTOR_DRY] * (s[at.ES_INPUT + at.IN_ABS_M])
    )
    handed_on = torque * (1.0 / p[layout.RATIO_TO_COUPLING] - p[at.EL_REACTION])
    if p[layout.MAP_COUNT] > 0.0:
        dry += slope * w
    else:
        s[e + layout.ENERGY_VISCOUS] += weight * slope * w * w
    s[e + layout.ENERGY_DRY] += weight * (dry - handed_on) * w
    s[e + layout.ENERGY_OFFSET] += weight * p[layout.OFFSET] * w


def elastic_motion(p, s, part, held, M, extra):
    """Advance the plant by one held segment, 0: the first f of the tick, 1: the rest; returns a status."""
    # held: voltage, or a source's input; M: moment at the output shaft; extra: torque at the motor shaft
    whole = p[layout.LENGTH + part]
    s[at.ES_HAPPENED] = 0.0
    if whole <= 0.0:
        return layout.OK
    s[at.ES_INPUT + at.IN_U], s[at.ES_INPUT + at.IN_M] = held, M
    s[at.ES_INPUT + at.IN_ABS_M], s[at.ES_INPUT + at.IN_EXTRA] = abs(M), extra
    put_torques(p, s)
    if p[layout.WITH_ENERGY] == 0.0 and stride(p, s, part, whole):
        return layout.OK
    return walk(p, s, whole)


def put_torques(p, s):
    """Held torques on both sides in the present mode."""
    x = at.ES_INPUT
    source = p[layout.SOURCE_GAIN] * s[x + at.IN_U]
    outside = source + s[x + at.IN_EXTRA] + p[at.EL_BACK] * s[x + at.IN_M]
    s[x + at.IN_MOTOR] = outside + s[at.ES_MOTOR_TORQUE] + s[at.ES_MOTOR_DRY] * s[x + at.IN_ABS_M]
    s[x + at.IN_LOAD] = s[x + at.IN_M] / p[at.EL_RATIO_BEHIND] + s[at.ES_LOAD_TORQUE]


def pace(p, s):
    """Square of the norm of x' in the units of energy, which bounds every derivative of a guard."""
    di, dw, dW, dd = modes.elastic_slopes(p, s)
    weight = int(s[at.ES_MODE]) + at.MODE_WEIGHT
    di, dw, dW, dd = di * p[weight], dw * p[weight + 1], dW * p[weight + 2], dd * p[weight + 3]
    return di * di + dw * dw + dW * dW + dd * dd


def guards_hold(p, s, chord, i, w, W, d):
    """Whether no guard can cross on the way to a state; notes how much room there is behind it."""
    room = LARGEST
    for j in range(int(s[at.ES_GUARDS])):
        g = at.ES_GUARD + j * at.GUARD_SIZE
        offset = modes.guard_offset(s, g)
        before = modes.guard_state(s, g) + offset
        after = s[g + at.G_I] * i + s[g + at.G_W] * w + (s[g + at.G_V] * W + s[g + at.G_D] * d) + offset
        if not (min(before, after) > s[g + at.G_CURVE] * chord):
            return False
        room = min(room, after * s[g + at.G_ROOM])
    s[at.ES_ROOM] = room
    return True


def row_of(p, o, i, w, W, d, u, a, b):
    """One row of a transition: what state and held inputs make of a number."""
    return (
        p[o] * i + p[o + 1] * w + p[o + 2] * W + p[o + 3] * d + (p[o + 4] * u + p[o + 5] * a + p[o + 6] * b)
    )


def stride(p, s, number, h):
    """Take a precomputed step of length h if no guard can cross in it: 0, 1 the segments, 2 + j Ts/2^j."""
    # guards are looked at only where the state may have come near one since
    m = int(s[at.ES_MODE])
    o = m + at.MODE_REACH + 3 + int(p[at.EL_LEVELS]) + number * at.STEP_SIZE
    i, w, W, d = s[layout.S_CURRENT], s[layout.S_SPEED], s[at.ES_LOAD_SPEED], s[at.ES_TWIST]
    x = at.ES_INPUT
    u, a, b = s[x + at.IN_U], s[x + at.IN_MOTOR], s[x + at.IN_LOAD]
    i1 = row_of(p, o, i, w, W, d, u, a, b)
    w1 = row_of(p, o + at.STEP_COLUMNS, i, w, W, d, u, a, b)
    W1 = row_of(p, o + 2 * at.STEP_COLUMNS, i, w, W, d, u, a, b)
    d1 = row_of(p, o + 3 * at.STEP_COLUMNS, i, w, W, d, u, a, b)
    turned = row_of(p, o + 4 * at.STEP_COLUMNS, i, w, W, d, u, a, b)
    if s[at.ES_GUARDS] > 0.0:
        far, squared = p[m + at.MODE_REACH + number], pace(p, s)
        reach = far * math.sqrt(squared)
        if s[at.ES_ROOM] * s[at.ES_ROOM] > SURE * (far * far * squared):  # does not wait for the root
            s[at.ES_ROOM] -= reach
        elif not guards_hold(p, s, 0.125 * h * reach, i1, w1, W1, d1):
            return False
    put_state(p, s, i1, w1, W1, d1, turned)
    return True


def put_state(p, s, i, w, W, d, turned):
    """Write the state; the load's angle is what the motor's angle and the twist leave, or as it was."""
    apart = s[at.ES_CONTACT] == at.GAP  # a load that is pressed goes with the twist, even before it turns
    stands = s[at.ES_LOAD] == 0.0 or (apart and W == 0.0 and s[at.ES_LOAD_SPEED] == 0.0)
    s[layout.S_CURRENT], s[layout.S_SPEED], s[at.ES_LOAD_SPEED], s[at.ES_TWIST] = i, w, W, d
    s[layout.S_ANGLE] += turned
    if not stands:
        s[at.ES_LOAD_ANGLE] = s[layout.S_ANGLE] / p[layout.RATIO_TO_COUPLING] - d
    modes.put_output(p, s)


@seldom
def walk(p, s, whole):
    """Advance with every event located."""
    levels, energy = int(p[at.EL_LEVELS]), p[layout.WITH_ENERGY] > 0.0
    shortest = math.ldexp(p[layout.PERIOD], -levels)
    left, level, events, steps = whole, 0, 0, 0
    while left > 0.0:
        steps += 1
        s[layout.S_STEPS] += 1.0
        if events > int(p[layout.MAX_EVENTS]) or steps > at.MAX_STEPS:
            return layout.TOO_MANY_EVENTS
        if not (abs(s[layout.S_SPEED]) < FINITE and abs(s[at.ES_LOAD_SPEED]) < FINITE):
            return layout.NOT_FINITE
        if levels > 0 and not energy and left > shortest:
            while level < levels and math.ldexp(p[layout.PERIOD], -level) > left:
                level += 1
            h = math.ldexp(p[layout.PERIOD], -level)
            if stride(p, s, 2 + level, h):
                left -= h
                level = max(level - 1, 0)
                continue
            if level < levels:
                level += 1
                continue
        h = min(left, shortest)
        s[at.ES_ROOM] = 0.0  # what is walked is not counted
        series.fill_series(p, s)
        t, event = first_event(p, s, h)
        if energy:
            add_energies(p, s, t)
        if t > 0.0:
            i, w, W, d, turned = series.series_state(p, s, t)
            put_state(p, s, i, w, W, d, turned)
            left -= t
        if event != at.NO_EVENT:
            modes.change_mode(p, s, event)
            put_torques(p, s)
            events += 1
            s[at.ES_HAPPENED] += 1.0
            level = max(level - 1, 0)
    return layout.OK


def first_event(p, s, h):
    """Time and number of the first event of the interval whose series is filled; h and 0 if none."""
    best, event = h, at.NO_EVENT
    m, n = int(s[at.ES_MODE]), int(p[at.EL_TERMS])
    i, w, W, d, _turned = series.series_state(p, s, h)
    chord = 0.125 * h * h * p[m + at.MODE_GROWTH] * math.sqrt(pace(p, s))
    if not (chord < LARGEST):
        return best, event
    for j in range(int(s[at.ES_GUARDS])):
        g = at.ES_GUARD + j * at.GUARD_SIZE
        offset = modes.guard_offset(s, g)
        before = modes.guard_state(s, g) + offset
        after = s[g + at.G_I] * i + s[g + at.G_W] * w + (s[g + at.G_V] * W + s[g + at.G_D] * d) + offset
        if min(before, after) > s[g + at.G_CURVE] * chord:
            continue
        tolerance = series.fill_polynomial(p, s, g, offset, h)
        number = int(s[g + at.G_EVENT])
        t = series.AT_ONCE
        breaks_away = at.MOTOR_UP <= number <= at.MOTOR_DOWN or at.LOAD_UP <= number <= at.LOAD_DOWN
        # a step of the inputs can break a rest at once, even if it would hold again later
        if not (breaks_away and before < -tolerance):
            t = series.first_fall(s, n, best, tolerance)
        if t == series.AT_ONCE:
            t = 0.0
        if t != series.NEVER and (t < best or event == at.NO_EVENT):
            best, event = t, number
    return best, event
