"""The mode of the event-driven plant: what holds in it, what ends it, and what comes next.

Every guard is an affine function of the state and the held inputs.  Two guards of one event are one
expression and its negation, so that rounding cannot let both be false.
"""

import math

from nonlinear._kernels import elastic_layout as at
from nonlinear._kernels import layout
from nonlinear._kernels.elastic_series import rounding_of, slopes_of
from nonlinear._kernels.elastic_steps import COEFFICIENTS, COLUMNS, ROWS

KERNELS = True


def contact_side(s):
    """1 or -1 while the coupling transmits torque on that side, else 0."""
    code = s[at.ES_CONTACT]
    return code if abs(code) == 1.0 else 0.0


def spring_of(p, s, side):
    """Stiffness of the piece that holds, and where its line passes zero: T_s = k (delta - rest)."""
    bend = s[at.ES_BEND]
    place = at.EL_SPRING + int(abs(bend)) * at.SPRING_SIZE
    sign = side if bend == 0.0 else (1.0 if bend > 0.0 else -1.0)
    return p[place + at.SPRING_STIFFNESS], sign * p[place + at.SPRING_HALF]


def spring_expression(p, s, side):
    """side T_s as if in contact: side (k (delta - rest) + c delta')."""
    rate = s[layout.S_SPEED] / p[layout.RATIO_TO_COUPLING] - s[at.ES_LOAD_SPEED]
    k, rest = spring_of(p, s, side)
    return side * (k * (s[at.ES_TWIST] - rest)) + side * p[layout.COUPLING_DAMPING] * rate


def map_place(p, s):
    """Place of the segment of the friction map that holds."""
    side = 0 if s[layout.S_DIRECTION] >= 0.0 else at.MAP_SIDE
    return at.EL_MAP + side + int(s[at.ES_SEGMENT]) * at.MAP_SEGMENT


def mode_number(p, s):
    """Number of the mode in the block of parameters."""
    motor = 0
    if s[layout.S_DIRECTION] > 0.0:
        motor = 1 + int(s[at.ES_SEGMENT])
    if s[layout.S_DIRECTION] < 0.0:
        motor = 1 + int(p[at.EL_SEGMENTS]) + int(s[at.ES_SEGMENT])
    side = contact_side(s)
    contact = 0 if side == 0.0 else (1 if side > 0.0 else 2) + 2 * int(abs(s[at.ES_BEND]))
    load = 1 if s[at.ES_LOAD] != 0.0 else 0
    return (2 + 4 * int(p[at.EL_SPRINGS])) * motor + 2 * contact + load


def enter_mode(p, s):
    """Write what follows from the discrete state: place of the mode, constant torques, guards."""
    mode = at.EL_MODES + mode_number(p, s) * int(p[at.EL_MODE_SIZE])
    s[at.ES_MODE] = float(mode)
    side, direction, load = contact_side(s), s[layout.S_DIRECTION], s[at.ES_LOAD]
    k, rest = spring_of(p, s, side)
    preload = abs(side) * k * rest
    share = p[at.EL_REACTION] + direction * side * p[at.EL_LOAD_COEFFICIENT]
    level = p[map_place(p, s) + at.MAP_LEVEL]
    s[at.ES_MOTOR_TORQUE] = share * preload - p[layout.OFFSET] - direction * level
    s[at.ES_MOTOR_DRY] = -direction * p[at.EL_LOAD_COEFFICIENT] if p[layout.RIGID] > 0.0 else 0.0
    s[at.ES_LOAD_TORQUE] = -preload - load * p[layout.LOAD_DRY] - p[layout.LOAD_OFFSET]
    s[at.ES_GUARDS] = s[at.ES_ROOM] = 0.0
    if p[layout.RIGID] == 0.0:
        contact_guards(p, s)
    if p[at.EL_SMOOTH] == 0.0:
        motor_guards(p, s)
    if p[layout.RIGID] == 0.0 and p[at.EL_LOAD_SMOOTH] == 0.0:
        load_guards(p, s)
    for j in range(int(s[at.ES_GUARDS])):
        put_curvature(p, s, mode, at.ES_GUARD + j * at.GUARD_SIZE)
        put_room(p, s, mode, at.ES_GUARD + j * at.GUARD_SIZE)


def new_guard(s, event):
    """Append an empty guard; returns its place."""
    count = int(s[at.ES_GUARDS])
    g = at.ES_GUARD + count * at.GUARD_SIZE
    for j in range(at.GUARD_SIZE):
        s[g + j] = 0.0
    s[g + at.G_EVENT] = float(event)
    s[at.ES_GUARDS] = float(count + 1)
    return g


def twist_guard(s, sign, side, twist, event):
    """sign (side delta - twist) > 0."""
    g = new_guard(s, event)
    s[g + at.G_D], s[g + at.G_ONE] = sign * side, -sign * twist


def spring_guard(p, s, sign, side, event):
    """sign side (k (delta - rest) + c delta') > 0."""
    g = new_guard(s, event)
    k, rest = spring_of(p, s, side)
    c = p[layout.COUPLING_DAMPING]
    s[g + at.G_W], s[g + at.G_V] = sign * side * c / p[layout.RATIO_TO_COUPLING], -sign * side * c
    s[g + at.G_D], s[g + at.G_ONE] = sign * side * k, -sign * side * k * rest


def bend_guards(p, s):
    """The twist stays on its piece of the spring, on either side; with play zero lies in the gap."""
    last, bend = int(p[at.EL_SPRINGS]) - 1, int(s[at.ES_BEND])
    code, one_sided = s[at.ES_CONTACT], p[layout.HALF_PLAY] > 0.0
    ends = at.EL_SPRING + at.SPRING_TWIST
    if bend < last and (bend < 0 or code > 0.0 or not one_sided):
        twist = p[ends + (bend + 1) * at.SPRING_SIZE] if bend >= 0 else -p[ends - bend * at.SPRING_SIZE]
        twist_guard(s, -1.0, 1.0, twist, at.BEND_PLUS)
    if bend > -last and (bend > 0 or code < 0.0 or not one_sided):
        twist = p[ends + bend * at.SPRING_SIZE] if bend > 0 else -p[ends + (1 - bend) * at.SPRING_SIZE]
        twist_guard(s, 1.0, 1.0, twist, at.BEND_MINUS)


def contact_guards(p, s):
    """Guards of contact, of the gap, and of the time between parting and the gap."""
    code, half = s[at.ES_CONTACT], p[layout.HALF_PLAY]
    if code == at.GAP:
        twist_guard(s, -1.0, 1.0, half, at.MEET_PLUS)
        twist_guard(s, -1.0, -1.0, half, at.MEET_MINUS)
        return
    bend_guards(p, s)
    if abs(code) == 2.0:
        spring_guard(p, s, -1.0, 0.5 * code, at.REJOIN)
        twist_guard(s, 1.0, 0.5 * code, half, at.INSIDE)
    elif half == 0.0:
        if p[at.EL_LOAD_COEFFICIENT] > 0.0:
            spring_guard(p, s, 1.0, code, at.FLIP)
    elif p[layout.COUPLING_DAMPING] == 0.0:
        twist_guard(s, 1.0, code, half, at.PART)
    else:
        spring_guard(p, s, 1.0, code, at.PART)


def motor_guards(p, s):
    """Slip: the speed stays on its segment.  Rest: the drive torque stays within the breakaway level."""
    direction = s[layout.S_DIRECTION]
    if direction == 0.0:
        motor_rest_guard(p, s, 1.0, at.MOTOR_UP)
        motor_rest_guard(p, s, -1.0, at.MOTOR_DOWN)
        return
    place = map_place(p, s)
    g = new_guard(s, at.MOTOR_LOWER)
    s[g + at.G_W], s[g + at.G_ONE] = direction, -p[place + at.MAP_SPEED]
    side = 0 if direction > 0.0 else 1
    if int(s[at.ES_SEGMENT]) + 1 < int(p[at.EL_SEGMENTS + side]):
        g = new_guard(s, at.MOTOR_UPPER)
        s[g + at.G_W], s[g + at.G_ONE] = -direction, p[place + at.MAP_SEGMENT + at.MAP_SPEED]


def motor_rest_guard(p, s, sign, event):
    """ratio (T0 + CM' |T_s|) - sign (kM i - offset - T_s/N_c + ...) > 0, with w = 0 in T_s."""
    g = new_guard(s, event)
    ratio, CM = p[layout.BREAKAWAY], p[at.EL_LOAD_COEFFICIENT]
    level = p[at.EL_MAP + (0 if sign > 0.0 else at.MAP_SIDE) + at.MAP_LEVEL]
    side = contact_side(s)
    torque = ratio * CM * side + sign * p[at.EL_REACTION]  # factor of T_s
    s[g + at.G_V] = -torque * abs(side) * p[layout.COUPLING_DAMPING]
    k, rest = spring_of(p, s, side)
    s[g + at.G_D] = torque * abs(side) * k
    s[g + at.G_ONE] = ratio * level + sign * p[layout.OFFSET] - torque * abs(side) * k * rest
    if p[layout.SOURCE] > 0.0:
        s[g + at.G_U] = -sign * p[layout.SOURCE_GAIN]
    else:
        s[g + at.G_I] = -sign * p[layout.TORQUE_CONSTANT]
    s[g + at.G_M] = -sign * p[at.EL_BACK]
    s[g + at.G_ABS_M] = ratio * CM if p[layout.RIGID] > 0.0 else 0.0
    s[g + at.G_EXTRA] = -sign


def load_guards(p, s):
    """Slip: W keeps its sign.  Rest: |T_s + M_ext/N_r - offset_l| within its breakaway level."""
    direction = s[at.ES_LOAD]
    if direction != 0.0:
        g = new_guard(s, at.LOAD_LANDS)
        s[g + at.G_V] = direction
        return
    load_rest_guard(p, s, 1.0, at.LOAD_UP)
    load_rest_guard(p, s, -1.0, at.LOAD_DOWN)


def load_rest_guard(p, s, sign, event):
    """ratio_l C0_l - sign (T_s + M_ext/N_r - offset_l) > 0, with W = 0 in T_s."""
    g = new_guard(s, event)
    side = contact_side(s)
    k, rest = spring_of(p, s, side)
    k, c = abs(side) * k, abs(side) * p[layout.COUPLING_DAMPING]
    s[g + at.G_W], s[g + at.G_D] = -sign * c / p[layout.RATIO_TO_COUPLING], -sign * k
    level = p[layout.LOAD_BREAKAWAY] * p[layout.LOAD_DRY]
    s[g + at.G_ONE] = level + sign * (p[layout.LOAD_OFFSET] + k * rest)
    s[g + at.G_M] = -sign / p[at.EL_RATIO_BEHIND]


def put_curvature(p, s, mode, g):
    """Bound of |g''| over the norm of x': the norm of G A dual to that of the energy."""
    total = 0.0
    for column in range(4):
        row, weight = 0.0, p[mode + at.MODE_WEIGHT + column]
        for j in range(COEFFICIENTS):
            if COLUMNS[j] == column:
                row += s[g + ROWS[j]] * p[mode + j]
        if weight > 0.0:
            total += (row / weight) * (row / weight)
    s[g + at.G_CURVE] = math.sqrt(total)


def put_room(p, s, mode, g):
    """How far the state may go for each unit of the guard's value; 0 where inputs move it at once."""
    # so far the chord bound of a whole period holds too: |g| and Ts/8 |g''| for |x'| = 1
    total, moved = 0.0, 0.0
    for j in range(4):
        weight = p[mode + at.MODE_WEIGHT + j]
        if s[g + j] != 0.0:
            total += (s[g + j] / weight) * (s[g + j] / weight) if weight > 0.0 else math.inf
        moved += abs(s[g + at.G_U + j])
    steep = math.sqrt(total) + 0.125 * p[layout.PERIOD] * s[g + at.G_CURVE]
    s[g + at.G_ROOM] = 1.0 / steep if moved == 0.0 and steep > 0.0 else 0.0


def guard_offset(s, g):
    """The part of a guard that does not depend on the state."""
    value = s[g + at.G_ONE]
    value += s[g + at.G_U] * s[at.ES_INPUT + at.IN_U]
    value += s[g + at.G_M] * s[at.ES_INPUT + at.IN_M]
    value += s[g + at.G_ABS_M] * s[at.ES_INPUT + at.IN_ABS_M]
    return value + s[g + at.G_EXTRA] * s[at.ES_INPUT + at.IN_EXTRA]


def guard_state(s, g):
    """The part of a guard that is linear in (i, w, W, delta)."""
    value = s[g + at.G_I] * s[layout.S_CURRENT] + s[g + at.G_W] * s[layout.S_SPEED]
    return value + (s[g + at.G_V] * s[at.ES_LOAD_SPEED] + s[g + at.G_D] * s[at.ES_TWIST])


def fails(p, s, event):
    """Whether the guard of an event is broken by more than the rounding of a short interval."""
    h = math.ldexp(p[layout.PERIOD], -int(p[at.EL_LEVELS]))
    for j in range(int(s[at.ES_GUARDS])):
        g = at.ES_GUARD + j * at.GUARD_SIZE
        if s[g + at.G_EVENT] == float(event):
            offset = guard_offset(s, g)
            return guard_state(s, g) + offset < -rounding_of(p, s, g, offset, h)
    return False


def elastic_slopes(p, s):
    """(i', w', W', delta') in the present mode under the inputs that were held last."""
    x, w, W = at.ES_INPUT, s[layout.S_SPEED], s[at.ES_LOAD_SPEED]
    u, torque, load = s[x + at.IN_U], s[x + at.IN_MOTOR], s[x + at.IN_LOAD]
    return slopes_of(p, int(s[at.ES_MODE]), s[layout.S_CURRENT], w, W, s[at.ES_TWIST], u, torque, load)


def find_mode(p, s):
    """The discrete state that belongs to speeds and twist: at t_0, and after a change of parameters."""
    w, W = s[layout.S_SPEED], s[at.ES_LOAD_SPEED]
    direction = 1.0 if p[at.EL_SMOOTH] > 0.0 or w > 0.0 else (-1.0 if w < 0.0 else 0.0)
    s[layout.S_DIRECTION], s[at.ES_SEGMENT] = direction, 0.0
    side = 0 if direction >= 0.0 else 1
    for j in range(1, int(p[at.EL_SEGMENTS + side])):
        if direction * w > p[at.EL_MAP + side * at.MAP_SIDE + j * at.MAP_SEGMENT + at.MAP_SPEED]:
            s[at.ES_SEGMENT] = float(j)
    if p[layout.RIGID] == 0.0:
        s[at.ES_LOAD] = 1.0 if p[at.EL_LOAD_SMOOTH] > 0.0 or W > 0.0 else (-1.0 if W < 0.0 else 0.0)
        start_contact(p, s)
    enter_mode(p, s)


def start_contact(p, s):
    """Piece of the spring and contact as the state says."""
    s[at.ES_BEND], s[at.ES_CONTACT] = 0.0, at.GAP
    for j in range(1, int(p[at.EL_SPRINGS])):
        if abs(s[at.ES_TWIST]) > p[at.EL_SPRING + j * at.SPRING_SIZE + at.SPRING_TWIST]:
            s[at.ES_BEND] = float(j) if s[at.ES_TWIST] > 0.0 else -float(j)
    if p[layout.HALF_PLAY] == 0.0:
        negative = p[at.EL_LOAD_COEFFICIENT] > 0.0 and spring_expression(p, s, 1.0) < 0.0
        s[at.ES_CONTACT] = -1.0 if negative else 1.0
    elif s[at.ES_TWIST] > p[layout.HALF_PLAY]:
        s[at.ES_CONTACT] = 1.0 if spring_expression(p, s, 1.0) > 0.0 else 2.0
    elif -s[at.ES_TWIST] > p[layout.HALF_PLAY]:
        s[at.ES_CONTACT] = -1.0 if spring_expression(p, s, -1.0) > 0.0 else -2.0


def put_output(p, s):
    """Angle and speed of the output shaft; of a rigid drive, those of the motor."""
    if p[layout.RIGID] > 0.0:
        s[layout.S_OUTPUT] = s[layout.S_ANGLE] / p[layout.RATIO]
        s[layout.S_OUTPUT_SPEED] = s[layout.S_SPEED] / p[layout.RATIO]
        return
    s[layout.S_OUTPUT], s[layout.S_OUTPUT_SPEED] = s[at.ES_LOAD_ANGLE], s[at.ES_LOAD_SPEED]
    if p[at.EL_RATIO_BEHIND] != 1.0:
        s[layout.S_OUTPUT] /= p[at.EL_RATIO_BEHIND]
        s[layout.S_OUTPUT_SPEED] /= p[at.EL_RATIO_BEHIND]


def change_contact(p, s, event):
    """The coupling meets, parts, its torque changes sign, or its spring bends."""
    code = s[at.ES_CONTACT]
    if event == at.BEND_PLUS or event == at.BEND_MINUS:
        s[at.ES_BEND] += 1.0 if event == at.BEND_PLUS else -1.0
    elif event == at.FLIP:
        s[at.ES_CONTACT] = -code
    elif event == at.PART:
        s[at.ES_CONTACT] = at.GAP if p[layout.COUPLING_DAMPING] == 0.0 else 2.0 * code
    elif event == at.REJOIN:
        s[at.ES_CONTACT] = 0.5 * code
    elif event == at.INSIDE:
        s[at.ES_CONTACT] = at.GAP
    else:
        side = 1.0 if event == at.MEET_PLUS else -1.0
        waits = p[layout.COUPLING_DAMPING] > 0.0 and spring_expression(p, s, side) <= 0.0
        s[at.ES_CONTACT] = 2.0 * side if waits else side


def land(p, s, speed, slip, up):
    """A side's speed has come to zero: rest if its breakaways, ``up`` and the next, hold, else reversal."""
    direction = s[slip]
    s[speed], s[slip] = 0.0, 0.0
    enter_mode(p, s)
    if fails(p, s, up + 1 if direction > 0.0 else up):
        s[slip] = -direction


def change_mode(p, s, event):
    """What an event does to the discrete state; only the speed that stops is set, to exactly 0."""
    if event <= at.BEND_MINUS:
        change_contact(p, s, event)
    elif event == at.MOTOR_UP or event == at.MOTOR_DOWN:
        s[layout.S_DIRECTION] = 1.0 if event == at.MOTOR_UP else -1.0
    elif event == at.MOTOR_UPPER:
        s[at.ES_SEGMENT] += 1.0
    elif event == at.MOTOR_LOWER:
        if s[at.ES_SEGMENT] > 0.0:
            s[at.ES_SEGMENT] -= 1.0
        else:
            land(p, s, layout.S_SPEED, layout.S_DIRECTION, at.MOTOR_UP)
    elif event == at.LOAD_LANDS:
        land(p, s, at.ES_LOAD_SPEED, at.ES_LOAD, at.LOAD_UP)
    else:
        s[at.ES_LOAD] = 1.0 if event == at.LOAD_UP else -1.0
    enter_mode(p, s)
