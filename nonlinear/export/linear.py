"""The running tick as a linear map, cut at a place of a loop; emitted only, for the live page.

Without dry friction, limits and grids the tick is a linear map, which is found by running it: from
each unit state, and with a unit input at the place where the loop is cut.  What comes out are A, b, c of
``x+ = A x + b v, y = c x`` at the period of the stage, to rounding.  Angles are measured from the motor's
angle (a stored angle is its distance from it), so that a loop that does not see the angle has no state for
it.  Rows are flat; MOST states at the most.
"""

# mypy: disallow-untyped-defs=False
import math

import numpy as np

from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.blocks import CLAMPED
from nonlinear._kernels.start import derive, prepare_sizes
from nonlinear._kernels.tick import tick
from nonlinear.export.linear_row import at_rest, set_off

KERNELS = True

MOST = 48  # states of a loop
CURRENT, VELOCITY, POSITION, COMMAND = range(4)
AT_SPEED, AT_CURRENT, AT_VOLTAGE = range(4, 7)  # break points of the closed drive; POSITION is the output's
AT_LAW = 7  # what a law of one's own of the current gives, before feed-forward
ANSWER = 8  # of the current or the velocity, with a law of one's own, to its command: that loop run closed
# the probe of each; -1: it is run through its command
POINT = (
    layout.POINT_CURRENT, -1, layout.POINT_OUTPUT, -1,
    layout.POINT_SPEED, layout.POINT_CURRENT, layout.POINT_VOLTAGE, layout.POINT_VOLTAGE,
)  # fmt: skip
NO_LOOP, TOO_LONG, LOST = 0, -1, -2  # lost: no double holds what a tick gives
MOST_TICKS = 16  # of a column that are noted
# signals in front of limiters, and the integral that the limit of one clamps as well (0: none)
SPEED, CURRENT_COMMAND, VOLTAGE, BESIDE_CURRENT, BESIDE_VOLTAGE = range(5)
SEEN = 5

# what the drive remembers, beside chains, delay line and stored angles; the angle first
REMEMBERED = np.array([
    layout.S_ANGLE, layout.S_TRACKED_ERROR, layout.S_CURRENT, layout.S_SPEED, layout.S_CURRENT_INTEGRATOR,
    layout.S_VELOCITY_INTEGRATOR, layout.S_POSITION_INTEGRATOR, layout.S_SPEED_COMMAND,
    layout.S_SPEED_REFERENCE, layout.S_CURRENT_REFERENCE, layout.S_VOLTAGE, layout.S_MEASURED_SPEED,
    layout.S_FILTERED_SPEED, layout.S_TRACKED_SPEED, layout.S_REFERENCE, layout.S_REFERENCE_BEFORE,
    layout.S_ERROR, layout.S_ERROR_RATE, layout.S_TORQUE_FEEDFORWARD,
    elastic_layout.ES_LOAD_SPEED, elastic_layout.ES_TWIST,
])  # fmt: skip


def answering(q, stage):
    """The stage that a loop is of: an answer is that of the stage with a law of one's own."""
    if stage != ANSWER:
        return stage
    return CURRENT if q[layout.OWN_STAGE] == layout.OWN_CURRENT else VELOCITY


def cut_of(q, stage):
    """Where the loop of a stage is cut: with a law of one's own at what that gives."""
    # only to that of the current something is added on the way to the break point that it drives
    own = q[layout.OWN_STAGE]
    if stage == ANSWER:
        return answering(q, stage)
    position = stage == POSITION and own == layout.OWN_POSITION
    if stage == CURRENT and own == layout.OWN_CURRENT:
        return AT_LAW
    if position and q[layout.HAS_VELOCITY] > 0.0:
        return AT_SPEED
    if position or (stage == VELOCITY and own == layout.OWN_VELOCITY):
        return AT_CURRENT if q[layout.HAS_CURRENT] > 0.0 else AT_VOLTAGE
    return stage


def feeds_speed(q):
    """Whether the measured speed is fed forward to the voltage, or taken by a law of the current."""
    taken = q[layout.OWN_STAGE] == layout.OWN_CURRENT and q[layout.OWN_READS_SPEED] > 0.0
    return q[layout.HAS_CURRENT] > 0.0 and (q[layout.BACK_EMF_FEEDFORWARD] != 0.0 or taken)


def speed_interval(q):
    """Ticks between two updates of the velocity stage, 1 where there is none."""
    return int(q[layout.EVERY_VELOCITY]) if q[layout.HAS_VELOCITY] > 0.0 else 1


def command_interval(q):
    """Ticks between two commands of the drive."""
    return int(q[layout.EVERY_POSITION]) if q[layout.HAS_POSITION] > 0.0 else speed_interval(q)


def interval(q, stage):
    """Ticks from one update of the signal at a cut to the next; 0 where the drive has no such loop."""
    current, velocity = q[layout.HAS_CURRENT] > 0.0, q[layout.HAS_VELOCITY] > 0.0
    position, of = q[layout.HAS_POSITION] > 0.0, answering(q, stage)
    if of == CURRENT:
        return 1 if current else NO_LOOP
    if of == VELOCITY:
        return speed_interval(q) if velocity else NO_LOOP
    if stage == POSITION or stage == COMMAND or stage == AT_SPEED:
        there = stage == COMMAND or (position and (stage == POSITION or velocity))
        return command_interval(q) if there else NO_LOOP
    if stage == AT_VOLTAGE and current:
        return 1
    if (not velocity and not position) or (stage == AT_CURRENT and not current):
        return NO_LOOP
    return speed_interval(q) if velocity else command_interval(q)


def repeats(q, stage):
    """Ticks after which the loop repeats: more than `interval` where it is periodic."""
    every = interval(q, stage)
    speed = speed_interval(q) if feeds_speed(q) else 1
    if answering(q, stage) == CURRENT:
        return max(every, speed)
    if stage != AT_CURRENT and stage != AT_VOLTAGE:
        return every
    return max(command_interval(q), max(speed, every))


def added(places, count, first, length):
    """Add places one after the other to a list; how many there are then, with those past MOST."""
    for k in range(length):
        if count + k < MOST:
            places[count + k] = float(first + k)
    return count + length


def listed(q, places):
    """Where the drive remembers something, angles first; how many there are, and how many are angles."""
    places[0] = float(REMEMBERED[0])
    angles = added(places, 1, int(q[layout.AT_ANGLES]), int(q[layout.DIFFERENCE_SAMPLES]))
    count = angles
    for k in range(1, REMEMBERED.shape[0]):
        count = added(places, count, int(REMEMBERED[k]), 1)
    count = added(places, count, layout.S_COMMAND_CHAIN, 2 * int(q[layout.COMMAND_FILTERS]))
    count = added(places, count, layout.S_SPEED_CHAIN, 2 * int(q[layout.SPEED_FILTERS]))
    count = added(places, count, layout.S_TORQUE_CHAIN, 2 * int(q[layout.TORQUE_FILTERS]))
    count = added(places, count, int(q[layout.AT_OWN]), int(q[layout.OWN_STATES]))
    count = added(places, count, layout.S_QUEUE, int(q[layout.DELAY_LINE]))
    return count, angles


def seen_value(q, s, io, stage):
    """What a loop returns at the tick that has just been run."""
    if stage == CURRENT:
        return io[layout.IO_CURRENT]
    if stage == VELOCITY:
        return s[layout.S_MEASURED_SPEED]
    if stage == POSITION:
        return q[layout.RATIO] * s[layout.S_OUTPUT_BEFORE]
    if stage == COMMAND:
        return io[layout.IO_OUTPUT]
    if stage == AT_SPEED:
        return s[layout.S_SPEED_COMMAND]
    if stage == AT_LAW:
        return s[layout.S_VOLTAGE_BEFORE] - q[layout.BACK_EMF_FEEDFORWARD] * s[layout.S_MEASURED_SPEED]
    return s[layout.S_CURRENT_BEFORE] if stage == AT_CURRENT else s[layout.S_VOLTAGE_BEFORE]


def put_inputs(q, s, io, stage, size):
    """Write the inputs of a tick: nothing, or the unit at the place where the loop is cut."""
    for k in range(layout.IN_PROBE + 4):
        io[k] = 0.0
    if stage == CURRENT and q[layout.HAS_VELOCITY] > 0.0:  # whether the velocity stage runs now or not
        io[layout.IN_PROBE + layout.POINT_CURRENT] = size
        s[layout.S_CURRENT_REFERENCE] = size
    elif stage == VELOCITY:
        io[layout.IN_COMMAND] = size / q[layout.RATIO]
    elif stage == CURRENT or stage == COMMAND:
        io[layout.IN_COMMAND] = size
    else:
        io[layout.IN_PROBE + POINT[stage]] = -size / q[layout.RATIO] if stage == POSITION else -size


def noted(q, s, k, j, seen):
    """Put down what stands in front of each limiter at tick k, as column j."""
    at = k * SEEN * (MOST + 1) + j
    for signal in range(SEEN):
        seen[at + signal * (MOST + 1)] = 0.0
    seen[at + SPEED * (MOST + 1)] = s[layout.S_SPEED_COMMAND]
    seen[at + CURRENT_COMMAND * (MOST + 1)] = s[layout.S_CURRENT_BEFORE]
    seen[at + VOLTAGE * (MOST + 1)] = s[layout.S_VOLTAGE_BEFORE]
    if int(q[layout.VELOCITY_WINDUP]) == CLAMPED and q[layout.TORQUE_FILTERS] <= 0.0:
        beside = BESIDE_CURRENT if q[layout.HAS_CURRENT] > 0.0 else BESIDE_VOLTAGE
        seen[at + beside * (MOST + 1)] = s[layout.S_VELOCITY_INTEGRATOR]
    if q[layout.HAS_CURRENT] > 0.0 and int(q[layout.CURRENT_WINDUP]) == CLAMPED:
        seen[at + BESIDE_VOLTAGE * (MOST + 1)] = s[layout.S_CURRENT_INTEGRATOR]


def one_column(q, s, io, stage, every, size, places, count, angles, j, blocks, begin, apart, seen):
    """Run the drive over one period; returns what the loop gave, NaN where a tick failed."""
    # the states after it go into blocks from begin on, so many numbers apart
    put_inputs(q, s, io, stage, size)
    value = 0.0
    for k in range(every):
        if tick(q, s, io) != layout.OK:
            return math.nan
        if k == 0:
            value = seen_value(q, s, io, stage)
        if k < MOST_TICKS:
            noted(q, s, k, j, seen)
    base = s[layout.S_ANGLE]
    for i in range(count):
        reached = s[int(places[i])]
        if i > 0 and i < angles:
            reached -= base
            if abs(reached) < 1e-15 * abs(base):
                reached = 0.0
        blocks[begin + i * apart] = reached
    return value


def until_next(every, ticks):
    """Ticks until a stage runs next, so many ticks after it ran."""
    passed = ticks - every * int(ticks / every)
    return float(every - passed) if passed > 0 else 0.0


def put_unit(q, s, places, j, angles, ticks):
    """Put the drive into the j-th unit state, -1: at rest; the motor's angle takes stored ones with it."""
    # the slower stages are where they are so many ticks after they all ran
    at_rest(q, s)
    s[layout.S_UNTIL_OUTER] = until_next(int(q[layout.OUTER_EVERY]), ticks)
    s[layout.S_UNTIL_VELOCITY] = until_next(int(q[layout.EVERY_VELOCITY]), ticks)
    if j == 0:
        for i in range(angles):
            s[int(places[i])] = 1.0
    elif j > 0:
        s[int(places[j])] = 1.0
    set_off(q, s)


def block(q, s, io, stage, first, every, places, n, angles, blocks, at, seen):
    """A, b, c of the loop as run over ``every`` ticks from tick ``first``; 0 where a tick failed."""
    for j in range(n):
        put_unit(q, s, places, j, angles, first)
        value = one_column(q, s, io, stage, every, 0.0, places, n, angles, j, blocks, at + j, n, seen)
        if math.isnan(value):
            return 0
        blocks[at + n * n + n + j] = value
    put_unit(q, s, places, -1, angles, first)
    value = one_column(q, s, io, stage, every, 1.0, places, n, angles, MOST, blocks, at + n * n, 1, seen)
    return 0 if math.isnan(value) else 1


def cut_here(q, stage):
    """Put a probe in that lets nothing through but what is injected, or all where the loop is run closed."""
    if POINT[stage] >= 0 and (stage != CURRENT or q[layout.HAS_VELOCITY] > 0.0):
        at = layout.PROBES + POINT[stage] * layout.PROBE_SIZE
        q[at + layout.PROBE_ON], q[at + layout.PROBE_GAIN] = 1.0, 1.0 if stage == AT_LAW else 0.0


def prepared(q, s, stage):
    """Make ``q`` the row of the linear drive with its loop cut, and derive it; 0 where it is too long."""
    of = answering(q, stage)
    if of == CURRENT or of == VELOCITY:  # no stages outside; its command is then that of the drive
        q[layout.HAS_POSITION], q[layout.COMMAND_FILTERS] = 0.0, 0.0
    if stage == CURRENT:
        q[layout.RESISTANCE_FEEDFORWARD] = 0.0
    if of == CURRENT:
        if repeats(q, of) == 1:  # one whose slower measurement is fed to the voltage stays, its output cut
            q[layout.HAS_VELOCITY] = 0.0
        cut_here(q, of)
    cut_here(q, cut_of(q, stage))
    prepare_sizes(q)
    if not (q[layout.DELAY_LINE] + q[layout.DIFFERENCE_SAMPLES] <= MOST):  # those alone pass it
        return 0
    derive(q, s)
    return 1


def runs_closed(stage):
    """Whether a loop is run closed: through the command of its own stage, or beside what its law gives."""
    return stage == CURRENT or stage == VELOCITY or stage == AT_LAW
