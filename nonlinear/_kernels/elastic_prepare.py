"""Everything of the event-driven plant that does not change with time: its modes and their transitions.

A mode is (motor at rest or slipping on a segment of its friction map) x (gap, contact on either side) x
(load at rest or slipping).  Each holds its matrix, a norm that its energy cannot outgrow, and exact
transitions over both held segments and over Ts/2^j.
"""

import math

from nonlinear._kernels import elastic_layout as at
from nonlinear._kernels import layout
from nonlinear._kernels.elastic_steps import double_step, growth_of, keep_step, norm_of, put_short_step

KERNELS = True

SHORT = 0.5  # norm of A times the shortest interval
MOST_LEVELS = 30
LARGEST_POWER = 700.0  # of e in double precision


def prepare_elastic_sizes(p):
    """Shares, friction segments, halvings of the period, and the length of p, which reaches to `EL_LEAST`."""
    put_shares(p)
    norm, modes = 0.0, mode_count(p)
    for number in range(modes):  # one after the other in the place of the first
        put_mode(p, number, at.EL_MODES)
        norm = max(norm, norm_of(p, at.EL_MODES))
    product, levels = norm * p[layout.PERIOD], 0
    while product > SHORT and levels < MOST_LEVELS:
        product *= 0.5
        levels += 1
    terms, rest = 1, product  # of the Taylor series over the shortest interval
    while rest > 1e-18 and terms < at.MAX_TERMS:
        terms += 1
        rest *= product / terms
    p[at.EL_LEVELS], p[at.EL_TERMS] = float(levels), float(max(terms, 4))
    size = at.MODE_REACH + (3 + levels) * (1 + at.STEP_SIZE)
    p[at.EL_MODE_SIZE] = float(size)
    p[layout.PARAMETER_SIZE] = float(at.EL_MODES + modes * size)


def prepare_elastic(p, s):
    """Fill the modes, after `prepare_elastic_sizes` and `prepare`; ``s`` lends its work space."""
    if p[layout.RIGID] <= 0.0:
        turned = p[layout.ANGLE_START] / p[layout.RATIO_TO_COUPLING] - p[layout.TWIST_START]
        p[layout.OUTPUT_START] = turned / p[at.EL_RATIO_BEHIND]
    for number in range(mode_count(p)):
        m = at.EL_MODES + number * int(p[at.EL_MODE_SIZE])
        put_mode(p, number, m)
        put_bounds(p, m, growth_of(p, m, s, int(p[layout.AT_WORK])))
        put_steps(p, m, s, int(p[layout.AT_WORK]))


def put_shares(p):
    """How torques pass the gears, and whether anything happens at zero speed of either side."""
    behind = p[layout.RATIO] / p[layout.RATIO_TO_COUPLING]
    rigid, back = p[layout.RIGID] > 0.0, p[layout.BACK_DRIVABLE]
    p[at.EL_RATIO_BEHIND] = behind
    p[at.EL_REACTION] = back / p[layout.RATIO_TO_COUPLING]
    p[at.EL_BACK] = back / p[layout.RATIO] if rigid else 0.0
    p[at.EL_LOAD_COEFFICIENT] = p[layout.LOAD_COEFFICIENT] * (1.0 if rigid else behind)
    put_springs(p)
    for side in range(2):
        put_segments(p, side)
    forward, reverse = at.EL_MAP, at.EL_MAP + at.MAP_SIDE
    one = p[at.EL_SEGMENTS] == 1.0 and p[at.EL_SEGMENTS_REVERSE] == 1.0
    same = p[forward + at.MAP_SLOPE] == p[reverse + at.MAP_SLOPE]
    dry = abs(p[forward + at.MAP_LEVEL]) + abs(p[reverse + at.MAP_LEVEL]) + p[at.EL_LOAD_COEFFICIENT]
    p[at.EL_SMOOTH] = 1.0 if one and same and dry == 0.0 else 0.0
    p[at.EL_LOAD_SMOOTH] = 1.0 if p[layout.LOAD_DRY] == 0.0 else 0.0


def put_springs(p):
    """The pieces of the spring: stiffness, twist at which its line passes zero, twist at which it begins."""
    k, torque, begins, place = p[layout.STIFFNESS], 0.0, p[layout.HALF_PLAY], at.EL_SPRING
    p[place + at.SPRING_STIFFNESS], p[place + at.SPRING_HALF], p[place + at.SPRING_TWIST] = k, begins, begins
    p[at.EL_SPRINGS] = 1.0
    for j in range(2):
        bend = p[layout.BEND_TORQUE + 2 * j]
        if bend > torque:
            begins, torque, k = begins + (bend - torque) / k, bend, p[layout.BEND_STIFFNESS + 2 * j]
            place += at.SPRING_SIZE
            p[place + at.SPRING_STIFFNESS], p[place + at.SPRING_HALF] = k, begins - bend / k
            p[place + at.SPRING_TWIST] = begins
            p[at.EL_SPRINGS] += 1.0


def put_segments(p, side):
    """The motor's friction for w > 0 (side 0) or w < 0 as lines T = level + slope |w|; the last continues."""
    count, point = int(p[layout.MAP_COUNT + side]), layout.MAP + side * 2 * layout.MAX_POINTS
    place = at.EL_MAP + side * at.MAP_SIDE
    p[at.EL_SEGMENTS + side] = float(max(count - 1, 1))
    p[place + at.MAP_SPEED] = 0.0
    p[place + at.MAP_LEVEL], p[place + at.MAP_SLOPE] = p[point + 1], 0.0
    if count == 0:
        p[place + at.MAP_LEVEL], p[place + at.MAP_SLOPE] = p[layout.DRY + side], p[layout.VISCOUS + side]
    for _ in range(count - 1):
        slope = (p[point + 3] - p[point + 1]) / (p[point + 2] - p[point])
        p[place + at.MAP_SPEED], p[place + at.MAP_SLOPE] = p[point], slope
        p[place + at.MAP_LEVEL] = p[point + 1] - slope * p[point]
        point += 2
        place += at.MAP_SEGMENT


def mode_count(p):
    """Number of modes: motor at rest or on a segment, gap or contact on either side, load at rest or not."""
    motors = 1 + int(p[at.EL_SEGMENTS]) + int(p[at.EL_SEGMENTS_REVERSE])
    return (2 + 4 * int(p[at.EL_SPRINGS])) * motors


def motor_of(p, motor):
    """Direction of the motor (0 at rest) and slope of its friction, by number: rest, forward, reverse."""
    forward = int(p[at.EL_SEGMENTS])
    if motor == 0:
        return 0.0, 0.0
    if motor <= forward:
        return 1.0, p[at.EL_MAP + (motor - 1) * at.MAP_SEGMENT + at.MAP_SLOPE]
    return -1.0, p[at.EL_MAP + at.MAP_SIDE + (motor - 1 - forward) * at.MAP_SEGMENT + at.MAP_SLOPE]


def put_mode(p, number, m):
    """Coefficients and weights of a mode at ``p[m]``, numbered as in `elastic_modes.mode_number`."""
    for j in range(at.MODE_REACH):
        p[m + j] = 0.0
    each = 2 + 4 * int(p[at.EL_SPRINGS])
    motor = int(number / each)
    contact = int((number - each * motor) / 2)
    slips = number - each * motor - 2 * contact > 0
    piece = int((contact - 1) / 2) if contact > 0 else 0
    side = 0.0 if contact == 0 else float(3 + 4 * piece - 2 * contact)
    direction, slope = motor_of(p, motor)
    # T_s acts on the motor with 1/N_c and, through friction, with CM' sgn(w T_s)
    share = p[at.EL_REACTION] + direction * side * p[at.EL_LOAD_COEFFICIENT]
    spring = p[at.EL_SPRING + piece * at.SPRING_SIZE + at.SPRING_STIFFNESS]
    k = spring if contact > 0 else 0.0
    c = p[layout.COUPLING_DAMPING] if contact > 0 else 0.0
    put_motor(p, m, direction, slope, share, k, c)
    if p[layout.RIGID] == 0.0:
        put_load_side(p, m, direction != 0.0, slips, share, k, c)
    put_weights(p, m, spring)


def put_motor(p, m, direction, slope, share, k, c):
    """The current of a motor that has one; a slipping motor under its friction and the coupling."""
    J, L, source = p[layout.MOTOR_INERTIA], p[layout.INDUCTANCE], p[layout.SOURCE] > 0.0
    if not source:
        p[m + at.A_II], p[m + at.B_I] = -p[layout.RESISTANCE] / L, 1.0 / L
    if direction == 0.0:
        return
    if not source:
        p[m + at.A_IW], p[m + at.A_WI] = -p[layout.BACK_EMF] / L, p[layout.TORQUE_CONSTANT] / J
    p[m + at.B_W] = 1.0 / J
    p[m + at.A_WW] = -(slope + share * c / p[layout.RATIO_TO_COUPLING]) / J
    p[m + at.A_WD] = -share * k / J


def put_load_side(p, m, motor_slips, load_slips, share, k, c):
    """Twist and load speed."""
    N_c, J = p[layout.RATIO_TO_COUPLING], p[layout.LOAD_INERTIA]
    if motor_slips:
        p[m + at.A_DW] = 1.0 / N_c
    if load_slips:
        p[m + at.B_V], p[m + at.A_VD] = 1.0 / J, k / J
        p[m + at.A_VV] = -(p[layout.LOAD_VISCOUS] + c) / J
        p[m + at.A_DV] = -1.0
    if motor_slips and load_slips:
        p[m + at.A_WV], p[m + at.A_VW] = share * c / p[layout.MOTOR_INERTIA], c / (N_c * J)


def put_weights(p, m, k):
    """Square roots of L, J_m, J_l, k: in these units a passive plant does not grow."""
    # a state that acts on no other (the twist in the gap, the absent current) weighs nothing
    weight = m + at.MODE_WEIGHT
    p[weight] = 0.0 if p[layout.SOURCE] > 0.0 else math.sqrt(p[layout.INDUCTANCE])
    p[weight + 1] = math.sqrt(p[layout.MOTOR_INERTIA])
    p[weight + 2] = math.sqrt(p[layout.LOAD_INERTIA])
    free = p[m + at.A_WD] == 0.0 and p[m + at.A_VD] == 0.0
    p[weight + 3] = 0.0 if free else math.sqrt(k)


def put_bounds(p, m, growth):
    """Growth of the energy's norm over the shortest interval; how far |x'| = 1 goes in h, h exp(growth h)."""
    levels = int(p[at.EL_LEVELS])
    h = math.ldexp(p[layout.PERIOD], -levels)
    p[m + at.MODE_GROWTH] = math.exp(min(growth * h, LARGEST_POWER))
    for j in range(3 + levels):
        h = p[layout.LENGTH + j] if j < 2 else math.ldexp(p[layout.PERIOD], 2 - j)
        p[m + at.MODE_REACH + j] = h * math.exp(min(growth * h, LARGEST_POWER))


def put_steps(p, m, s, work):
    """Transitions over both held segments, and over Ts/2^j from the shortest up."""
    levels = int(p[at.EL_LEVELS])
    o = m + at.MODE_REACH + 3 + levels
    for part in range(2):
        put_short_step(p, m, math.ldexp(p[layout.LENGTH + part], -levels), s, work)
        for _ in range(levels):
            double_step(s, work)
        keep_step(p, o + part * at.STEP_SIZE, s, work)
    put_short_step(p, m, math.ldexp(p[layout.PERIOD], -levels), s, work)
    keep_step(p, o + (2 + levels) * at.STEP_SIZE, s, work)
    for j in range(levels):
        double_step(s, work)
        keep_step(p, o + (1 + levels - j) * at.STEP_SIZE, s, work)
