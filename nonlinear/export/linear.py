"""The sampled loops out of the running tick itself; emitted only, for the live page.

Without dry friction, limits and grids the tick is a linear map.  So every loop is found by running it: from
each unit state, and with a unit input at the place where the loop is cut.  What comes out are A, b, c of
``x+ = A x + b v, y = c x`` at the period of the stage, to rounding.  Angles are measured from the motor's
angle (a stored angle is its distance from it), so that a loop that does not see the angle has no state for
it.  Rows are flat; MOST states at the most.
"""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import math

import numpy as np

from nonlinear._kernels import layout
from nonlinear._kernels.tick import tick
from nonlinear.export.entries import derive, emitted, init, prepare_sizes

MOST = 48  # states of a loop
CURRENT, VELOCITY, POSITION, COMMAND = range(4)
AT_SPEED, AT_CURRENT, AT_VOLTAGE = range(4, 7)  # break points of the closed drive; POSITION is the output's
NO_LOOP, TOO_LONG, PERIODIC, ELASTIC = 0, -1, -2, -3

CLEARED = np.array([
    layout.LAW, layout.DRY, layout.DRY_REVERSE, layout.LOAD_COEFFICIENT, layout.OFFSET, layout.LOAD,
    layout.GRAVITY, layout.FRICTION_FEEDFORWARD, layout.COUNTS_PER_RAD, layout.POSITION_COUNTS,
    layout.PROFILED, layout.PROFILE_SAMPLES, layout.SUPPLY, layout.OVERLOAD, layout.CURRENT_RESOLUTION,
    layout.CURRENT_NOISE, layout.ANGLE_NOISE, layout.OUTPUT_NOISE, layout.JITTER, layout.SEED,
    layout.CURRENT_START, layout.SPEED_START, layout.ANGLE_START, layout.CURRENT_INTEGRATOR_START,
    layout.VELOCITY_INTEGRATOR_START, layout.SPEED_COMMAND_START, layout.CURRENT_COMMAND_START,
    layout.VOLTAGE_START, layout.LOAD_TABLE_LENGTH, layout.TORQUE_TABLE_LENGTH, layout.WITH_ENERGY,
])  # fmt: skip
UNLIMITED = np.array(
    [layout.SPEED_LIMIT, layout.ACCELERATION_LIMIT, layout.CURRENT_LIMIT, layout.VOLTAGE_LIMIT]
)
# what the drive remembers, beside chains, delay line and stored angles; the angles first
REMEMBERED = np.array([
    layout.S_ANGLE, layout.S_TRACKED_ANGLE, layout.S_CURRENT, layout.S_SPEED, layout.S_CURRENT_INTEGRATOR,
    layout.S_VELOCITY_INTEGRATOR, layout.S_POSITION_INTEGRATOR, layout.S_SPEED_COMMAND,
    layout.S_SPEED_REFERENCE, layout.S_CURRENT_REFERENCE, layout.S_VOLTAGE, layout.S_MEASURED_SPEED,
    layout.S_FILTERED_SPEED, layout.S_TRACKED_SPEED, layout.S_REFERENCE, layout.S_REFERENCE_BEFORE,
    layout.S_ERROR, layout.S_ERROR_RATE, layout.S_TORQUE_FEEDFORWARD,
])  # fmt: skip


@emitted
def linear_row(p, q):
    """Copy the parameters of a run, without anything that is not linear; gravity becomes its slope."""
    for k in range(layout.SIZE):
        q[k] = p[k]
    q[layout.LOAD_SLOPE] += p[layout.GRAVITY] * math.cos(p[layout.GRAVITY_ANGLE])
    for k in range(CLEARED.shape[0]):
        q[CLEARED[k]] = 0.0
    for k in range(UNLIMITED.shape[0]):
        q[UNLIMITED[k]] = math.inf
    q[layout.VISCOUS_REVERSE] = q[layout.VISCOUS]


@emitted
def without_outer(q, stage):
    """Take the stages outside of one away; its command is then that of the drive."""
    if stage == CURRENT or stage == VELOCITY:
        q[layout.HAS_POSITION], q[layout.COMMAND_FILTERS] = 0.0, 0.0
    if stage == CURRENT:
        q[layout.HAS_VELOCITY], q[layout.RESISTANCE_FEEDFORWARD] = 0.0, 0.0


@emitted
def cut_point(stage):
    """The probe that cuts the loop, or -1."""
    if stage == POSITION:
        return layout.POINT_OUTPUT
    if stage == AT_SPEED:
        return layout.POINT_SPEED
    if stage == AT_CURRENT:
        return layout.POINT_CURRENT
    return layout.POINT_VOLTAGE if stage == AT_VOLTAGE else -1


@emitted
def interval(q, stage):
    """Ticks from one update of a loop to the next; 0 where the drive has no such loop, PERIODIC too."""
    outer = 1
    if q[layout.HAS_VELOCITY] > 0.0:
        outer = int(q[layout.EVERY_VELOCITY])
    slow = int(q[layout.EVERY_POSITION]) if q[layout.HAS_POSITION] > 0.0 else outer
    fed = q[layout.HAS_CURRENT] > 0.0 and q[layout.BACK_EMF_FEEDFORWARD] != 0.0
    if stage == CURRENT:
        if q[layout.HAS_CURRENT] <= 0.0:
            return NO_LOOP
        return PERIODIC if fed and int(q[layout.EVERY_VELOCITY]) > 1 else 1
    if stage == VELOCITY:
        return outer if q[layout.HAS_VELOCITY] > 0.0 else NO_LOOP
    if stage == POSITION or stage == COMMAND:
        return slow if q[layout.HAS_POSITION] > 0.0 else NO_LOOP
    if stage == AT_SPEED:
        return slow if q[layout.HAS_VELOCITY] > 0.0 and q[layout.HAS_POSITION] > 0.0 else NO_LOOP
    made = 1  # how often the signal at the break point is made
    if stage == AT_CURRENT:
        if q[layout.HAS_CURRENT] <= 0.0 or (q[layout.HAS_VELOCITY] <= 0.0 and q[layout.HAS_POSITION] <= 0.0):
            return NO_LOOP
        made = outer if q[layout.HAS_VELOCITY] > 0.0 else slow
    elif q[layout.HAS_CURRENT] <= 0.0:
        made = outer if q[layout.HAS_VELOCITY] > 0.0 else slow
    loops = q[layout.HAS_CURRENT] + q[layout.HAS_VELOCITY] + q[layout.HAS_POSITION]
    if stage == AT_VOLTAGE and loops <= 0.0:
        return NO_LOOP
    whole = slow
    if fed and int(q[layout.EVERY_VELOCITY]) > whole:
        whole = int(q[layout.EVERY_VELOCITY])
    return made if whole == made else PERIODIC


@emitted
def too_long(q):
    """Whether the delay line or the stored angles alone pass MOST, before anything is laid out for them."""
    return not (q[layout.DELAY_LINE] + q[layout.DIFFERENCE_SAMPLES] <= MOST)


@emitted
def listed(q, places):
    """Where the drive remembers something, angles first; how many there are, and how many are angles."""
    count = 2
    places[0], places[1] = float(REMEMBERED[0]), float(REMEMBERED[1])
    for k in range(int(q[layout.DIFFERENCE_SAMPLES])):
        if count < MOST:
            places[count] = q[layout.AT_ANGLES] + k
        count += 1
    angles = count
    for k in range(2, REMEMBERED.shape[0]):
        if count < MOST:
            places[count] = float(REMEMBERED[k])
        count += 1
    for k in range(2 * int(q[layout.COMMAND_FILTERS])):
        if count < MOST:
            places[count] = float(layout.S_COMMAND_CHAIN + k)
        count += 1
    for k in range(2 * int(q[layout.SPEED_FILTERS])):
        if count < MOST:
            places[count] = float(layout.S_SPEED_CHAIN + k)
        count += 1
    for k in range(2 * int(q[layout.TORQUE_FILTERS])):
        if count < MOST:
            places[count] = float(layout.S_TORQUE_CHAIN + k)
        count += 1
    for k in range(int(q[layout.DELAY_LINE])):
        if count < MOST:
            places[count] = float(layout.S_QUEUE + k)
        count += 1
    return count, angles


@emitted
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
    return s[layout.S_CURRENT_BEFORE] if stage == AT_CURRENT else s[layout.S_VOLTAGE_BEFORE]


@emitted
def put_inputs(q, io, stage, size):
    """Write the inputs of a tick: nothing, or the unit at the place where the loop is cut."""
    for k in range(layout.IN_PROBE + 4):
        io[k] = 0.0
    if stage == VELOCITY:
        io[layout.IN_COMMAND] = size / q[layout.RATIO]
    elif stage == CURRENT or stage == COMMAND:
        io[layout.IN_COMMAND] = size
    elif stage == POSITION:
        io[layout.IN_PROBE + layout.POINT_OUTPUT] = -size / q[layout.RATIO]
    elif stage == AT_SPEED:
        io[layout.IN_PROBE + layout.POINT_SPEED] = -size
    elif stage == AT_CURRENT:
        io[layout.IN_PROBE + layout.POINT_CURRENT] = -size
    else:
        io[layout.IN_PROBE + layout.POINT_VOLTAGE] = -size


@emitted
def one_column(q, s, io, stage, every, size, places, count, angles, column):
    """Run the drive as it stands over one period; writes the states after it, returns what the loop gave.

    NaN where a tick failed.
    """
    put_inputs(q, io, stage, size)
    value = 0.0
    for k in range(every):
        status = tick(q, s, io)
        if status != layout.OK:
            return math.nan
        if k == 0:
            value = seen_value(q, s, io, stage)
    base = s[layout.S_ANGLE]
    for i in range(count):
        column[i] = s[int(places[i])]
        if i > 0 and i < angles:
            column[i] -= base
            if abs(column[i]) < 1e-15 * abs(base):
                column[i] = 0.0
    return value


@emitted
def needed(n, a, b, c, keep):
    """Mark the states that the output sees and the input reaches; how many they are."""
    for i in range(n):
        keep[i] = 1.0 if c[i] != 0.0 else 0.0
        keep[n + i] = 1.0 if b[i] != 0.0 else 0.0
    for _round in range(n):
        for i in range(n):
            for j in range(n):
                if a[i * n + j] != 0.0 and keep[i] > 0.0:
                    keep[j] = 1.0
                if a[i * n + j] != 0.0 and keep[n + j] > 0.0:
                    keep[n + i] = 1.0
    count = 0
    for i in range(n):
        keep[i] = 1.0 if keep[i] > 0.0 and keep[n + i] > 0.0 else 0.0
        count += int(keep[i])
    return count


@emitted
def pruned(n, a, b, c, keep):
    """Leave out the other states, in place; the number that stays."""
    count = needed(n, a, b, c, keep)
    to_row = 0
    for i in range(n):
        if keep[i] <= 0.0:
            continue
        to = 0
        for j in range(n):
            if keep[j] > 0.0:
                a[to_row * count + to] = a[i * n + j]
                to += 1
        b[to_row] = b[i]
        c[to_row] = c[i]
        to_row += 1
    return count


@emitted
def put_unit(s, places, j, angles):
    """Put the drive into the j-th unit state: the motor's angle takes the stored ones with it."""
    if j == 0:
        for i in range(angles):
            s[int(places[i])] = 1.0
    else:
        s[int(places[j])] = 1.0


@emitted
def assembled(p, q, s, io, stage, a, b, c, places, column):
    """A, b, c of a loop of the drive with the parameters p; the number of states, or what stands in the way.

    ``q``, ``s`` and ``io`` are rows of a second drive that is run here; ``q[PERIOD]`` and ``interval`` give
    the period.
    """
    if p[layout.ELASTIC_DRIVE] > 0.0:  # its contact is not linear
        return ELASTIC
    linear_row(p, q)
    every = interval(q, stage)
    if every <= 0:
        return every
    without_outer(q, stage)
    point = cut_point(stage)
    if point >= 0:
        q[layout.PROBES + point * layout.PROBE_SIZE + layout.PROBE_ON] = 1.0
        q[layout.PROBES + point * layout.PROBE_SIZE + layout.PROBE_GAIN] = 0.0
    prepare_sizes(q)
    if too_long(q):
        return TOO_LONG
    n, angles = listed(q, places)
    if n > MOST:
        return TOO_LONG
    derive(q, s)
    for j in range(n):
        init(q, s)
        put_unit(s, places, j, angles)
        value = one_column(q, s, io, stage, every, 0.0, places, n, angles, column)
        if math.isnan(value):
            return TOO_LONG
        c[j] = value
        for i in range(n):
            a[i * n + j] = column[i]
    init(q, s)
    value = one_column(q, s, io, stage, every, 1.0, places, n, angles, column)
    if math.isnan(value):
        return TOO_LONG
    for i in range(n):
        b[i] = column[i]
    if stage == CURRENT or stage == VELOCITY:  # these were run closed
        for i in range(n):
            for j in range(n):
                a[i * n + j] += b[i] * c[j]
    return pruned(n, a, b, c, column)


@emitted
def lead_of(p):
    """Feed-forward in front of a position loop as k_ff/(Kv T), NaN where it is more than that."""
    if p[layout.POSITION_INTEGRAL] != 0.0 or p[layout.DERIVATIVE] != 0.0:
        return math.nan
    if p[layout.ACCELERATION_FEEDFORWARD] != 0.0 or p[layout.COMMAND_FILTERS] > 0.0:
        return math.nan
    period = p[layout.EVERY_POSITION] * p[layout.PERIOD]
    return p[layout.FEEDFORWARD] / (p[layout.POSITION_GAIN] * period)
