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

from actuator_lti.batch._complex import over
from actuator_lti.batch._eigen import eigenvalues
from actuator_lti.batch._response import evaluate
from actuator_lti.batch._run import one_loop
from nonlinear._kernels import layout
from nonlinear._kernels.prepare import prepare_sizes
from nonlinear._kernels.tick import init, tick
from nonlinear.export.entries import derive, emitted

MOST = 48  # states of a loop
CURRENT, VELOCITY, POSITION, COMMAND = range(4)
AT_SPEED, AT_CURRENT, AT_VOLTAGE = range(4, 7)  # break points of the closed drive; POSITION is the output's
NO_LOOP, TOO_LONG, PERIODIC = 0, -1, -2
MOST_TICKS = 16  # between two commands, for what each limiter sees
SPEED, CURRENT_COMMAND, VOLTAGE = range(3)  # signals in front of limiters
SEEN = 3

CLEARED = np.array([
    layout.LAW, layout.DRY, layout.DRY_REVERSE, layout.LOAD_COEFFICIENT, layout.OFFSET, layout.LOAD,
    layout.GRAVITY, layout.FRICTION_FEEDFORWARD, layout.COUNTS_PER_RAD, layout.POSITION_COUNTS, layout.PROFILED,
    layout.PROFILE_SAMPLES, layout.SUPPLY, layout.OVERLOAD, layout.CURRENT_RESOLUTION, layout.CURRENT_NOISE,
    layout.ANGLE_NOISE, layout.OUTPUT_NOISE, layout.JITTER, layout.SEED, layout.CURRENT_START,
    layout.SPEED_START, layout.ANGLE_START, layout.CURRENT_INTEGRATOR_START, layout.VELOCITY_INTEGRATOR_START,
    layout.SPEED_COMMAND_START, layout.CURRENT_COMMAND_START, layout.VOLTAGE_START, layout.LOAD_TABLE_LENGTH,
    layout.TORQUE_TABLE_LENGTH, layout.WITH_ENERGY,
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
    if stage == AT_VOLTAGE and q[layout.HAS_CURRENT] <= 0.0 and q[layout.HAS_VELOCITY] <= 0.0:
        if q[layout.HAS_POSITION] <= 0.0:
            return NO_LOOP
    whole = slow
    if fed and int(q[layout.EVERY_VELOCITY]) > whole:
        whole = int(q[layout.EVERY_VELOCITY])
    return made if whole == made else PERIODIC


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
    """A, b, c of a loop from the drive with the parameters p; the number of states, or what stands in the way.

    ``q``, ``s`` and ``io`` are rows of a second drive that is run here; ``q[PERIOD]`` and ``interval`` give
    the period.
    """
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
    derive(q, s)
    n, angles = listed(q, places)
    if n > MOST:
        return TOO_LONG
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
    count = pruned(n, a, b, c, column)
    return count


@emitted
def lead_of(p):
    """Feed-forward in front of a position loop as k_ff/(Kv T), NaN where it is more than that."""
    if p[layout.POSITION_INTEGRAL] != 0.0 or p[layout.DERIVATIVE] != 0.0:
        return math.nan
    if p[layout.ACCELERATION_FEEDFORWARD] != 0.0 or p[layout.COMMAND_FILTERS] > 0.0:
        return math.nan
    period = p[layout.EVERY_POSITION] * p[layout.PERIOD]
    return p[layout.FEEDFORWARD] / (p[layout.POSITION_GAIN] * period)


@emitted
def poles_of(n, a, b, c, fed_back, poles, work, lent, lent_too, real, imaginary):
    """Poles of a loop, open and closed; 0 where they were not found."""
    for side in range(2):
        closed = fed_back * side
        for i in range(n):
            for j in range(n):
                work[i * n + j] = a[i * n + j] - closed * b[i] * c[j]
        found = eigenvalues(n, work, lent, lent_too, real, imaginary)
        if found == 0:
            return 0
        for i in range(n):
            poles[2 * side * n + i] = real[i]
            poles[(2 * side + 1) * n + i] = imaginary[i]
    return 1


@emitted
def figures(
    n,
    a,
    b,
    c,
    lead,
    time_figures,
    row,
    poles,
    points,
    stack,
    xs,
    rs,
    ss,
    work,
    state,
    exchanged,
    real,
    imaginary,
):
    """Figures of a loop that was assembled (see ``one_loop``); the number of scanned points, 0 without poles."""
    fed_back = 0.0 if math.isnan(lead) else 1.0
    found = poles_of(n, a, b, c, fed_back, poles, work, exchanged, state, real, imaginary)
    if found == 0:
        return 0
    count = one_loop(
        n, a, b, c, poles, lead, time_figures > 0, row, points, stack, xs, rs, ss, work, state, exchanged
    )
    return count


@emitted
def stepped(n, h, b, c, lead, count, y, state, after):
    """Step response of a closed loop at its samples; h is A - I. Where lead is NaN, of A, b, c as they are."""
    fed_back = 0.0 if math.isnan(lead) else 1.0
    for i in range(n):
        state[i] = 0.0
    y[0] = 0.0
    for k in range(1, count):
        error = 1.0 - fed_back * y[k - 1]
        if k == 1 and lead > 0.0:
            error += lead
        for i in range(n):
            value = state[i] + b[i] * error
            for j in range(n):
                value += h[i * n + j] * state[j]
            after[i] = value
        total = 0.0
        for i in range(n):
            state[i] = after[i]
            total += c[i] * after[i]
        y[k] = total


@emitted
def responded(n, h, b, c, count, xs, rs, work, state, exchanged):
    """Response of a loop at angles per sample, as pairs."""
    for k in range(count):
        rr, ri, _slope_r, _slope_i = evaluate(n, h, b, c, xs[k], work, state, exchanged)
        rs[2 * k], rs[2 * k + 1] = rr, ri


@emitted
def noted_column(q, s, io, stage, every, size, places, count, angles, column, seen, j):
    """As `one_column`, with what stands in front of each limiter at every tick put down as column j."""
    put_inputs(q, io, stage, size)
    for k in range(every):
        status = tick(q, s, io)
        if status != layout.OK:
            return 0
        at = k * SEEN * (MOST + 1)
        seen[at + SPEED * (MOST + 1) + j] = s[layout.S_SPEED_COMMAND]
        seen[at + CURRENT_COMMAND * (MOST + 1) + j] = s[layout.S_CURRENT_BEFORE]
        seen[at + VOLTAGE * (MOST + 1) + j] = s[layout.S_VOLTAGE_BEFORE]
    base = s[layout.S_ANGLE]
    for i in range(count):
        column[i] = s[int(places[i])]
        if i > 0 and i < angles:
            column[i] -= base
    return 1


@emitted
def outer_stage(q):
    """The stage that takes the command."""
    if q[layout.HAS_POSITION] > 0.0:
        return COMMAND
    return VELOCITY if q[layout.HAS_VELOCITY] > 0.0 else CURRENT


@emitted
def outer_interval(q):
    """Ticks between two commands."""
    if q[layout.HAS_POSITION] > 0.0:
        return int(q[layout.EVERY_POSITION])
    return int(q[layout.EVERY_VELOCITY]) if q[layout.HAS_VELOCITY] > 0.0 else 1


@emitted
def limiters_assembled(p, q, s, io, a, b, places, column, seen):
    """A and b of the closed drive from its command, and rows of ``seen``: (tick, signal), state; the last is d.

    The number of states, or what stands in the way.
    """
    linear_row(p, q)
    stage, every = outer_stage(q), outer_interval(q)
    if every > MOST_TICKS:
        return PERIODIC
    prepare_sizes(q)
    derive(q, s)
    n, angles = listed(q, places)
    if n > MOST:
        return TOO_LONG
    for j in range(n + 1):
        init(q, s)
        if j < n:
            put_unit(s, places, j, angles)
        size = 0.0 if j < n else 1.0
        to = j if j < n else MOST
        done = noted_column(q, s, io, stage, every, size, places, n, angles, column, seen, to)
        if done == 0:
            return TOO_LONG
        for i in range(n):
            if j < n:
                a[i * n + j] = column[i]
            else:
                b[i] = column[i]
    for i in range(n):
        places[i] = 0.0
        for k in range(every * SEEN):
            places[i] += abs(seen[k * (MOST + 1) + i])
    count = pruned(n, a, b, places, column)
    for k in range(every * SEEN):
        to_place = 0
        for i in range(n):
            if column[i] > 0.0:
                seen[k * (MOST + 1) + to_place] = seen[k * (MOST + 1) + i]
                to_place += 1
    return count


@emitted
def pivoted(n, k, work, state):
    """Bring the largest element of column k, from row k on, to row k."""
    best, largest = k, -1.0
    for i in range(k, n):
        size = abs(work[2 * (i * n + k)]) + abs(work[2 * (i * n + k) + 1])
        if size > largest:
            best, largest = i, size
    if best == k:
        return
    for j in range(2 * n):
        kept = work[2 * k * n + j]
        work[2 * k * n + j] = work[2 * best * n + j]
        work[2 * best * n + j] = kept
    for j in range(2):
        kept = state[2 * k + j]
        state[2 * k + j] = state[2 * best + j]
        state[2 * best + j] = kept


@emitted
def cleared(n, k, work, state):
    """Take row k out of the rows below it."""
    for i in range(k + 1, n):
        at, up = 2 * (i * n + k), 2 * (k * n + k)
        if work[at] == 0.0 and work[at + 1] == 0.0:
            continue
        factor_r, factor_i = over(work[at], work[at + 1], work[up], work[up + 1])
        for j in range(1, n - k):
            here_r, here_i = work[up + 2 * j], work[up + 2 * j + 1]
            work[at + 2 * j] -= factor_r * here_r - factor_i * here_i
            work[at + 2 * j + 1] -= factor_r * here_i + factor_i * here_r
        here_r, here_i = state[2 * k], state[2 * k + 1]
        state[2 * i] -= factor_r * here_r - factor_i * here_i
        state[2 * i + 1] -= factor_r * here_i + factor_i * here_r


@emitted
def states_at(n, a, b, x, work, state):
    """(z I - A)^-1 b at an angle per interval, as pairs; A as it is, whose zeros keep the states apart."""
    sine = math.sin(0.5 * x)
    for i in range(n):
        for j in range(n):
            work[2 * (i * n + j)] = -a[i * n + j]
            work[2 * (i * n + j) + 1] = 0.0
        work[2 * (i * n + i)] = (1.0 - a[i * n + i]) - 2.0 * sine * sine
        work[2 * (i * n + i) + 1] = math.sin(x)
        state[2 * i], state[2 * i + 1] = b[i], 0.0
    for k in range(n):
        pivoted(n, k, work, state)
        cleared(n, k, work, state)
    i = n - 1
    while i >= 0:
        total_r, total_i = state[2 * i], state[2 * i + 1]
        for j in range(i + 1, n):
            left_r, left_i = work[2 * (i * n + j)], work[2 * (i * n + j) + 1]
            total_r -= left_r * state[2 * j] - left_i * state[2 * j + 1]
            total_i -= left_r * state[2 * j + 1] + left_i * state[2 * j]
        total_r, total_i = over(total_r, total_i, work[2 * (i * n + i)], work[2 * (i * n + i) + 1])
        state[2 * i], state[2 * i + 1] = total_r, total_i
        i -= 1


@emitted
def limiter_sizes(n, a, b, seen, every, count, xs, sizes, work, state):
    """Largest magnitude, over the ticks between two commands, of each signal in front of a limiter.

    At each angle per interval of the command; ``sizes`` holds a row of ``count`` numbers for each signal.
    """
    for g in range(count):
        states_at(n, a, b, xs[g], work, state)
        for signal in range(SEEN):
            largest = 0.0
            for k in range(1 if signal == SPEED else every):
                at = (k * SEEN + signal) * (MOST + 1)
                real, imaginary = seen[at + MOST], 0.0
                for i in range(n):
                    real += seen[at + i] * state[2 * i]
                    imaginary += seen[at + i] * state[2 * i + 1]
                largest = max(largest, math.hypot(real, imaginary))
            sizes[signal * count + g] = largest
