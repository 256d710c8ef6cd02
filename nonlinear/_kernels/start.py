"""What comes before the first tick: lengths, what does not change with time, the state; a part of a tick."""

import math

from nonlinear._kernels import layout, tick
from nonlinear._kernels.elastic_modes import find_mode
from nonlinear._kernels.elastic_prepare import prepare_elastic, prepare_elastic_sizes
from nonlinear._kernels.energy import prepare_forms
from nonlinear._kernels.motion import count_events, event_path, fast_path, hold, put_load
from nonlinear._kernels.sense import seed_streams
from nonlinear._kernels.slipping import COMPLEX, describe, transition
from nonlinear._kernels.smooth import prepare_tanh

KERNELS = True


def prepare_run_sizes(p):
    """Places of the parts of the state whose lengths differ from drive to drive; both rows' lengths."""
    p[layout.PARAMETER_SIZE] = float(layout.P_SIZE)
    if p[layout.LAW] > 0.0:
        p[layout.PARAMETER_SIZE] += float(layout.TANH_SIZE)
        if p[layout.WITH_ENERGY] > 0.0:
            p[layout.PARAMETER_SIZE] += float(layout.TANH_FORMS_SIZE)
    p[layout.DELAY_LINE] = p[layout.DELAY_TICKS] + 2.0
    p[layout.AT_ANGLES] = layout.S_QUEUE + p[layout.DELAY_LINE]
    p[layout.AT_AVERAGE] = p[layout.AT_ANGLES] + p[layout.DIFFERENCE_SAMPLES]
    p[layout.AT_OWN] = p[layout.AT_AVERAGE] + p[layout.PROFILE_SAMPLES]
    p[layout.AT_PROBES] = p[layout.AT_OWN] + p[layout.OWN_STATES]
    longest, probing = 0.0, 0.0
    for point in range(4):
        at = layout.PROBES + point * layout.PROBE_SIZE
        longest = max(longest, p[at + layout.PROBE_DELAY])
        probing = max(probing, p[at + layout.PROBE_ON])
    p[layout.PROBING], p[layout.NOTING] = probing, max(probing, p[layout.OVERLOAD])
    p[layout.NOTING] = max(p[layout.NOTING], p[layout.ELASTIC_DRIVE])
    p[layout.PROBE_RING] = longest + layout.MAX_TAPS + 1.0 if probing > 0.0 else 1.0
    p[layout.AT_WORK] = p[layout.AT_PROBES] + 4.0 * p[layout.PROBE_RING]
    p[layout.STATE_SIZE] = p[layout.AT_WORK] + layout.WORK_SIZE


def prepare_periods(p):
    """Who is outermost, how often it is updated, and what that means for limits and rates."""
    every = 1.0
    if p[layout.HAS_POSITION] > 0.0:
        every = p[layout.EVERY_POSITION]
    elif p[layout.HAS_VELOCITY] > 0.0:
        every = p[layout.EVERY_VELOCITY]
    p[layout.OUTER_EVERY] = every
    p[layout.POSITION_PERIOD] = every * p[layout.PERIOD]
    p[layout.VELOCITY_PERIOD] = p[layout.EVERY_VELOCITY] * p[layout.PERIOD]
    p[layout.SPEED_STEP] = p[layout.ACCELERATION_LIMIT] * p[layout.POSITION_PERIOD]


def any_of(p, first, behind):
    """1 where one of the numbers from ``first`` up to ``behind`` is not zero."""
    found = 0.0
    for j in range(first, behind):
        if p[j] != 0.0:
            found = 1.0
    return found


def prepare_gates(p):
    """One number a stage that says whether it needs more than its short form."""
    more = max(any_of(p, layout.OUTPUT_SENSOR, layout.PROFILED), p[layout.PROFILED])
    more = max(more, any_of(p, layout.POSITION_INTEGRAL, layout.DERIVATIVE_COEFFICIENT))
    if p[layout.HAS_POSITION] <= 0.0 or p[layout.FEEDFORWARD] != 0.0:
        more = 1.0
    p[layout.HAS_FULL_COMMAND] = max(more, any_of(p, layout.COMMAND_FILTERS, layout.SPEED_FILTERS))
    plain = p[layout.SPEED_SOURCE] <= 0.0 and p[layout.FILTER_COEFFICIENT] >= 1.0
    p[layout.HAS_MEASURED_SPEED] = 0.0 if plain and p[layout.SPEED_FILTERS] <= 0.0 else 1.0
    p[layout.HAS_MEASURED_SPEED] = max(p[layout.HAS_MEASURED_SPEED], p[layout.SPEED_SENSOR])
    more = any_of(p, layout.ACCELERATION_FEEDFORWARD, layout.PROFILED)
    more = max(more, any_of(p, layout.TORQUE_FILTERS, layout.TRACKING_ANGLE))
    p[layout.HAS_FULL_VELOCITY] = max(more, any_of(p, layout.VELOCITY_WINDUP, layout.VELOCITY_TRACKING))
    for j in range(layout.LIMITS, layout.OWN_A):
        if p[j] < math.inf:
            p[layout.HAS_FULL_VELOCITY] = 1.0
    more = max(any_of(p, layout.BACK_EMF_FEEDFORWARD, layout.SUPPLY), p[layout.OVERLOAD])
    p[layout.HAS_FULL_CURRENT] = max(more, any_of(p, layout.CURRENT_WINDUP, layout.CURRENT_TRACKING))
    more = max(p[layout.SUPPLY], any_of(p, layout.OUTPUT_SENSOR, layout.POSITION_COUNTS))
    p[layout.HAS_INSTRUMENTS] = max(more, any_of(p, layout.CURRENT_RESOLUTION, layout.SEED))
    p[layout.LOAD_VARIES] = any_of(p, layout.LOAD_SLOPE, layout.SUPPLY_TABLE)
    p[layout.OWN_MEASURES] = 0.0
    if p[layout.OWN_STAGE] > 0.0:
        prepare_own(p)


def prepare_own(p):
    """What a law of one's own needs besides: its stage's longer form, the sensors, perhaps the speed."""
    stage = p[layout.OWN_STAGE]
    p[layout.HAS_INSTRUMENTS] = 1.0
    if stage == layout.OWN_POSITION:
        p[layout.HAS_FULL_COMMAND] = 1.0
    elif stage == layout.OWN_VELOCITY:
        p[layout.HAS_FULL_VELOCITY] = 1.0
    else:
        p[layout.HAS_FULL_CURRENT] = 1.0
    if p[layout.OWN_READS_SPEED] > 0.0 and (p[layout.HAS_VELOCITY] <= 0.0 or stage == layout.OWN_POSITION):
        p[layout.OWN_MEASURES] = 1.0


def prepare_plant(p, work):
    """Transitions over both segments and both directions, eigenvalues, decay of a locked current."""
    Ts, f = p[layout.PERIOD], p[layout.DELAY_FRACTION]
    p[layout.LENGTH], p[layout.LENGTH + 1] = f, Ts - f
    p[layout.SPLIT] = 1.0 if f > 0.0 else 0.0
    ringing = 0.0
    at_work = int(p[layout.AT_WORK])
    for side in range(2):
        at = layout.MODES + side * layout.MODAL
        describe(p, side, at)
        if int(p[at + layout.KIND]) == COMPLEX and p[at + layout.ROOT] * Ts >= 3.0:
            ringing = 1.0
        for part in range(2):
            place = layout.SLIP + (2 * side + part) * layout.TRANSITION
            transition(p, side, p[layout.LENGTH + part], work, at_work, place)
    p[layout.RELAX] = p[layout.RESISTANCE] / p[layout.INDUCTANCE]
    for part in range(2):
        p[layout.DECAY + part] = math.exp(-p[layout.RELAX] * p[layout.LENGTH + part])
    p[layout.LOCKED_GAIN] = 0.0 if p[layout.SOURCE] > 0.0 else 1.0 / p[layout.RESISTANCE]
    dry = p[layout.DRY] + p[layout.DRY_REVERSE] + p[layout.LOAD_COEFFICIENT]
    same = p[layout.VISCOUS] == p[layout.VISCOUS_REVERSE]
    p[layout.SMOOTH] = 1.0 if dry == 0.0 and same else 0.0
    p[layout.LOOK] = max(ringing, max(p[layout.LAW], p[layout.ELASTIC_DRIVE]))


def prepare_sizes(p):
    """Work out the lengths of both rows, first of all and after every change of p."""
    prepare_run_sizes(p)
    if p[layout.ELASTIC_DRIVE] > 0.0:
        prepare_elastic_sizes(p)


def derive(p, s):
    """Fill all derived parameters, after `prepare_sizes`; s lends its work space."""
    prepare_periods(p)
    prepare_gates(p)
    prepare_plant(p, s)
    if p[layout.WITH_ENERGY] > 0.0:
        prepare_forms(p, s)
    if p[layout.LAW] > 0.0:
        prepare_tanh(p, s)
    p[layout.OUTPUT_START] = p[layout.ANGLE_START] / p[layout.RATIO]
    if p[layout.ELASTIC_DRIVE] > 0.0:
        prepare_elastic(p, s)


def init(p, s):
    """Write the state at t_0, before the first tick, into s, p[STATE_SIZE] numbers."""
    for j in range(int(p[layout.STATE_SIZE])):
        s[j] = 0.0
    s[layout.S_CURRENT], s[layout.S_SPEED] = p[layout.CURRENT_START], p[layout.SPEED_START]
    s[layout.S_ANGLE] = p[layout.ANGLE_START]
    tick.put_direction(p, s)
    put_load(p, s, p[layout.LOAD], 0.0)
    tick.init_controller(p, s)
    tick.init_estimate(p, s)
    tick.init_command(p, s)
    tick.init_lines(p, s)
    seed_streams(s, p[layout.SEED])
    if p[layout.ELASTIC_DRIVE] > 0.0:
        tick.init_elastic(p, s)


def retune(p, s):
    """Fit the state to parameters that were changed between two ticks, after `derive`."""
    put_load(p, s, s[layout.S_LOAD], 0.0)
    tick.put_direction(p, s)
    if p[layout.ELASTIC_DRIVE] > 0.0:
        find_mode(p, s)


def part_of_tick(p, q, s, io, tau):
    """Sense, control, move to t_k + tau, 0 < tau < Ts, on a copy of the state; q, a copy of p, is used up."""
    # q becomes the plant over a tick of tau, exact as over a whole one: in both the voltage changes at f
    tick.decide(p, s, io)
    hold(p, s, io)
    q[layout.PERIOD], q[layout.DELAY_FRACTION] = tau, min(p[layout.DELAY_FRACTION], tau)
    derive(q, s)
    events = 0.0
    for part in range(2):
        if q[layout.LENGTH + part] > 0.0 and events >= 0.0:
            u = s[layout.S_QUEUE + part]
            s[layout.S_HELD] = u
            if fast_path(q, s, part, u) == 0:
                events = event_path(q, s, part, u, events)
    count_events(s, events)
    return int(s[layout.S_STATUS])
