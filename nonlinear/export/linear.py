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

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.start import derive, prepare_sizes
from nonlinear._kernels.tick import tick
from nonlinear.export.linear_row import at_rest, linear_row, set_off

MOST = 48  # states of a loop
CURRENT, VELOCITY, POSITION, COMMAND = range(4)
AT_SPEED, AT_CURRENT, AT_VOLTAGE = range(4, 7)  # break points of the closed drive; POSITION is the output's
NO_LOOP, TOO_LONG, PERIODIC, LOST = 0, -1, -2, -3  # lost: no double holds what a tick gives

# what the drive remembers, beside chains, delay line and stored angles; the angles first
REMEMBERED = np.array([
    layout.S_ANGLE, layout.S_TRACKED_ANGLE, layout.S_CURRENT, layout.S_SPEED, layout.S_CURRENT_INTEGRATOR,
    layout.S_VELOCITY_INTEGRATOR, layout.S_POSITION_INTEGRATOR, layout.S_SPEED_COMMAND,
    layout.S_SPEED_REFERENCE, layout.S_CURRENT_REFERENCE, layout.S_VOLTAGE, layout.S_MEASURED_SPEED,
    layout.S_FILTERED_SPEED, layout.S_TRACKED_SPEED, layout.S_REFERENCE, layout.S_REFERENCE_BEFORE,
    layout.S_ERROR, layout.S_ERROR_RATE, layout.S_TORQUE_FEEDFORWARD,
    elastic_layout.ES_LOAD_SPEED, elastic_layout.ES_TWIST,
])  # fmt: skip


@kernel
def without_outer(q, stage):
    """Take the stages outside of one away; its command is then that of the drive.

    A velocity stage whose slower measurement is fed to the voltage stays, its output cut off.
    """
    if stage == CURRENT or stage == VELOCITY:
        q[layout.HAS_POSITION], q[layout.COMMAND_FILTERS] = 0.0, 0.0
    if stage == CURRENT:
        q[layout.RESISTANCE_FEEDFORWARD] = 0.0
        if repeats(q, stage) == 1:
            q[layout.HAS_VELOCITY] = 0.0


@kernel
def cut_of(q, stage):
    """Where the loop of a stage is cut: with a law of one's own at the break point that it drives."""
    own = q[layout.OWN_STAGE]
    if stage == CURRENT and own == layout.OWN_CURRENT:
        return AT_VOLTAGE
    if stage == POSITION and own == layout.OWN_POSITION and q[layout.HAS_VELOCITY] > 0.0:
        return AT_SPEED
    outer = (stage == VELOCITY and own == layout.OWN_VELOCITY) or (
        stage == POSITION and own == layout.OWN_POSITION
    )
    if outer:
        return AT_CURRENT if q[layout.HAS_CURRENT] > 0.0 else AT_VOLTAGE
    return stage


@kernel
def cut_point(q, stage):
    """The probe that cuts the loop, or -1."""
    if stage == CURRENT and q[layout.HAS_VELOCITY] > 0.0:
        return layout.POINT_CURRENT
    if stage == POSITION:
        return layout.POINT_OUTPUT
    if stage == AT_SPEED:
        return layout.POINT_SPEED
    if stage == AT_CURRENT:
        return layout.POINT_CURRENT
    return layout.POINT_VOLTAGE if stage == AT_VOLTAGE else -1


@kernel
def feeds_speed(q):
    """Whether the measured speed is fed forward to the voltage, or taken by a law of the current."""
    taken = q[layout.OWN_STAGE] == layout.OWN_CURRENT and q[layout.OWN_READS_SPEED] > 0.0
    return q[layout.HAS_CURRENT] > 0.0 and (q[layout.BACK_EMF_FEEDFORWARD] != 0.0 or taken)


@kernel
def interval(q, stage):
    """Ticks from one update of the signal at a cut to the next; 0 where the drive has no such loop."""
    outer = int(q[layout.EVERY_VELOCITY]) if q[layout.HAS_VELOCITY] > 0.0 else 1
    slow = int(q[layout.EVERY_POSITION]) if q[layout.HAS_POSITION] > 0.0 else outer
    if stage == CURRENT:
        return 1 if q[layout.HAS_CURRENT] > 0.0 else NO_LOOP
    if stage == VELOCITY:
        return outer if q[layout.HAS_VELOCITY] > 0.0 else NO_LOOP
    if stage == POSITION or stage == COMMAND:
        return slow if q[layout.HAS_POSITION] > 0.0 else NO_LOOP
    if stage == AT_SPEED:
        return slow if q[layout.HAS_VELOCITY] > 0.0 and q[layout.HAS_POSITION] > 0.0 else NO_LOOP
    if stage == AT_VOLTAGE and q[layout.HAS_CURRENT] > 0.0:
        return 1
    if q[layout.HAS_VELOCITY] <= 0.0 and q[layout.HAS_POSITION] <= 0.0:
        return NO_LOOP
    if stage == AT_CURRENT and q[layout.HAS_CURRENT] <= 0.0:
        return NO_LOOP
    return outer if q[layout.HAS_VELOCITY] > 0.0 else slow


@kernel
def repeats(q, stage):
    """Ticks after which the loop repeats: more than `interval` where it is periodic."""
    every = interval(q, stage)
    speed = int(q[layout.EVERY_VELOCITY]) if feeds_speed(q) else 1
    if stage == CURRENT:
        return max(every, speed)
    if stage != AT_CURRENT and stage != AT_VOLTAGE:
        return every
    outer = int(q[layout.EVERY_VELOCITY]) if q[layout.HAS_VELOCITY] > 0.0 else 1
    slow = int(q[layout.EVERY_POSITION]) if q[layout.HAS_POSITION] > 0.0 else outer
    return max(slow, max(speed, every))


@kernel
def too_long(q):
    """Whether the delay line or the stored angles alone pass MOST, before anything is laid out for them."""
    return not (q[layout.DELAY_LINE] + q[layout.DIFFERENCE_SAMPLES] <= MOST)


@kernel
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
    for k in range(int(q[layout.OWN_STATES])):
        if count < MOST:
            places[count] = q[layout.AT_OWN] + k
        count += 1
    for k in range(int(q[layout.DELAY_LINE])):
        if count < MOST:
            places[count] = float(layout.S_QUEUE + k)
        count += 1
    return count, angles


@kernel
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


@kernel
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
    elif stage == POSITION:
        io[layout.IN_PROBE + layout.POINT_OUTPUT] = -size / q[layout.RATIO]
    elif stage == AT_SPEED:
        io[layout.IN_PROBE + layout.POINT_SPEED] = -size
    elif stage == AT_CURRENT:
        io[layout.IN_PROBE + layout.POINT_CURRENT] = -size
    else:
        io[layout.IN_PROBE + layout.POINT_VOLTAGE] = -size


@kernel
def one_column(q, s, io, stage, every, size, places, count, angles, column):
    """Run the drive as it stands over one period; writes the states after it, returns what the loop gave.

    NaN where a tick failed.
    """
    put_inputs(q, s, io, stage, size)
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


@kernel
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


@kernel
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


@kernel
def put_unit(q, s, places, j, angles):
    """Put the drive into the j-th unit state: the motor's angle takes the stored ones with it."""
    at_rest(q, s)
    if j == 0:
        for i in range(angles):
            s[int(places[i])] = 1.0
    else:
        s[int(places[j])] = 1.0
    set_off(q, s)


@kernel
def until_next(every, ticks):
    """Ticks until a stage runs next, so many ticks after it ran."""
    passed = ticks - every * int(ticks / every)
    return float(every - passed) if passed > 0 else 0.0


@kernel
def put_phase(q, s, ticks):
    """Let the slower stages be where they are so many ticks after they all ran."""
    s[layout.S_UNTIL_OUTER] = until_next(int(q[layout.OUTER_EVERY]), ticks)
    s[layout.S_UNTIL_VELOCITY] = until_next(int(q[layout.EVERY_VELOCITY]), ticks)


@kernel
def block(q, s, io, stage, first, every, places, n, angles, a, b, c, column):
    """A, b, c of the loop as run over the ``every`` ticks from tick ``first``; 0 where a tick failed."""
    for j in range(n + 1):
        if j < n:
            put_unit(q, s, places, j, angles)
        else:
            at_rest(q, s)
        put_phase(q, s, first)
        size = 0.0 if j < n else 1.0
        value = one_column(q, s, io, stage, every, size, places, n, angles, column)
        if math.isnan(value):
            return 0
        if j < n:
            c[j] = value
        for i in range(n):
            if j < n:
                a[i * n + j] = column[i]
            else:
                b[i] = column[i]
    return 1


@kernel
def cut_here(q, point):
    """Put a probe in that lets nothing through but what is injected; -1: none."""
    if point >= 0:
        q[layout.PROBES + point * layout.PROBE_SIZE + layout.PROBE_ON] = 1.0
        q[layout.PROBES + point * layout.PROBE_SIZE + layout.PROBE_GAIN] = 0.0


@kernel
def prepared(q, s, stage):
    """Make ``q`` the row of the linear drive with its loop cut, and derive it; 0 where it is too long."""
    without_outer(q, stage)
    cut_here(q, cut_point(q, stage) if stage == CURRENT else -1)  # of a velocity stage that had to stay
    cut_here(q, cut_point(q, cut_of(q, stage)))
    prepare_sizes(q)
    if too_long(q):
        return 0
    derive(q, s)
    return 1


@kernel
def runs_closed(stage):
    """Whether a loop is run closed, through the command of its own stage."""
    return stage == CURRENT or stage == VELOCITY


@kernel
def assembled(p, q, s, io, stage, a, b, c, places, column):
    """A, b, c of a loop of the drive with the parameters p; the number of states, or what stands in the way.

    ``q``, ``s`` and ``io`` are rows of a second drive that is run here; ``q[PERIOD]`` and ``interval`` give
    the period.
    """
    linear_row(p, q)
    every = interval(q, stage)
    if every <= 0:
        return NO_LOOP
    if repeats(q, stage) > every:
        return PERIODIC
    if prepared(q, s, stage) == 0:
        return TOO_LONG
    n, angles = listed(q, places)
    if n > MOST:
        return TOO_LONG
    cut = cut_of(q, stage)
    done = block(q, s, io, cut, 0, every, places, n, angles, a, b, c, column)
    if done == 0:
        return LOST
    if runs_closed(cut):
        for i in range(n):
            for j in range(n):
                a[i * n + j] += b[i] * c[j]
    return pruned(n, a, b, c, column)


@kernel
def lead_of(p):
    """Feed-forward in front of a position loop as k_ff/(Kv T), NaN where it is more than that."""
    if p[layout.ELASTIC_DRIVE] > 0.0 and p[layout.RIGID] <= 0.0 and p[layout.OUTPUT_SENSOR] <= 0.0:
        return math.nan  # the loop feeds back another angle than the output's
    if p[layout.POSITION_INTEGRAL] != 0.0 or p[layout.DERIVATIVE] != 0.0:
        return math.nan
    if p[layout.OWN_STAGE] == layout.OWN_POSITION:
        return math.nan
    if p[layout.ACCELERATION_FEEDFORWARD] != 0.0 or p[layout.COMMAND_FILTERS] > 0.0:
        return math.nan
    period = p[layout.EVERY_POSITION] * p[layout.PERIOD]
    return p[layout.FEEDFORWARD] / (p[layout.POSITION_GAIN] * period)
