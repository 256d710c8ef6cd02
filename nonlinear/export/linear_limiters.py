"""What stands in front of each limiter under a sinusoidal command; emitted only, for the live page.

Gains far below their largest value are differences of large numbers (an acceleration feed-forward).  So the
states are not mixed as a Hessenberg form would: ``z I - A`` is solved as it is.
"""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import math

from actuator_lti.batch._complex import over
from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout
from nonlinear._kernels.regulator import CLAMPED
from nonlinear._kernels.start import derive, prepare_sizes
from nonlinear._kernels.tick import tick
from nonlinear.export.linear import (
    COMMAND,
    CURRENT,
    LOST,
    MOST,
    PERIODIC,
    TOO_LONG,
    VELOCITY,
    listed,
    pruned,
    put_inputs,
    put_unit,
    too_long,
)
from nonlinear.export.linear_row import at_rest, linear_row

MOST_TICKS = 16  # between two commands
# signals in front of limiters, and the integral that the limit of one clamps as well (0: none)
SPEED, CURRENT_COMMAND, VOLTAGE, BESIDE_CURRENT, BESIDE_VOLTAGE = range(5)
SIGNALS = ("w_ref", "i_ref", "u")
SHOWN, SEEN = 3, 5


@kernel
def noted_column(q, s, io, stage, every, size, places, count, angles, column, seen, j):
    """As `one_column`, with what stands in front of each limiter at every tick put down as column j."""
    put_inputs(q, s, io, stage, size)
    for k in range(every):
        status = tick(q, s, io)
        if status != layout.OK:
            return 0
        at = k * SEEN * (MOST + 1)
        seen[at + SPEED * (MOST + 1) + j] = s[layout.S_SPEED_COMMAND]
        seen[at + CURRENT_COMMAND * (MOST + 1) + j] = s[layout.S_CURRENT_BEFORE]
        seen[at + VOLTAGE * (MOST + 1) + j] = s[layout.S_VOLTAGE_BEFORE]
        seen[at + BESIDE_CURRENT * (MOST + 1) + j] = seen[at + BESIDE_VOLTAGE * (MOST + 1) + j] = 0.0
        if int(q[layout.VELOCITY_WINDUP]) == CLAMPED and q[layout.TORQUE_FILTERS] <= 0.0:
            beside = BESIDE_CURRENT if q[layout.HAS_CURRENT] > 0.0 else BESIDE_VOLTAGE
            seen[at + beside * (MOST + 1) + j] = s[layout.S_VELOCITY_INTEGRATOR]
        if q[layout.HAS_CURRENT] > 0.0 and int(q[layout.CURRENT_WINDUP]) == CLAMPED:
            seen[at + BESIDE_VOLTAGE * (MOST + 1) + j] = s[layout.S_CURRENT_INTEGRATOR]
    base = s[layout.S_ANGLE]
    for i in range(count):
        column[i] = s[int(places[i])]
        if i > 0 and i < angles:
            column[i] -= base
    return 1


@kernel
def outer_stage(q):
    """The stage that takes the command."""
    if q[layout.HAS_POSITION] > 0.0:
        return COMMAND
    return VELOCITY if q[layout.HAS_VELOCITY] > 0.0 else CURRENT


@kernel
def of_command(q, stage):
    """The reference of a command of one: that of a speed drive is the motor's, its command the output's."""
    return q[layout.RATIO] if stage == VELOCITY else 1.0


@kernel
def outer_interval(q):
    """Ticks between two commands."""
    if q[layout.HAS_POSITION] > 0.0:
        return int(q[layout.EVERY_POSITION])
    return int(q[layout.EVERY_VELOCITY]) if q[layout.HAS_VELOCITY] > 0.0 else 1


@kernel
def limiters_assembled(p, q, s, io, a, b, places, column, seen):
    """A and b of the closed drive from its command, and rows of ``seen`` (tick, signal): states, then d.

    The number of states, or what stands in the way.
    """
    linear_row(p, q)
    stage, every = outer_stage(q), outer_interval(q)
    if every > MOST_TICKS:
        return PERIODIC
    prepare_sizes(q)
    if too_long(q):
        return TOO_LONG
    n, angles = listed(q, places)
    if n > MOST:
        return TOO_LONG
    derive(q, s)
    for j in range(n + 1):
        at_rest(q, s)
        if j < n:
            put_unit(q, s, places, j, angles)
        size = 0.0 if j < n else of_command(q, stage)
        to = j if j < n else MOST
        done = noted_column(q, s, io, stage, every, size, places, n, angles, column, seen, to)
        if done == 0:
            return LOST
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


@kernel
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


@kernel
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


@kernel
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


@kernel
def signal_interval(q, signal, every):
    """Ticks between two updates of a signal in front of a limiter."""
    if signal == VOLTAGE or signal == BESIDE_VOLTAGE:
        return 1
    if (signal == CURRENT_COMMAND or signal == BESIDE_CURRENT) and q[layout.HAS_VELOCITY] > 0.0:
        return int(q[layout.EVERY_VELOCITY])
    return every


@kernel
def seen_at(n, seen, signal, k, state):
    """A signal in front of a limiter at tick k, as a pair."""
    at = (k * SEEN + signal) * (MOST + 1)
    real, imaginary = seen[at + MOST], 0.0
    for i in range(n):
        real += seen[at + i] * state[2 * i]
        imaginary += seen[at + i] * state[2 * i + 1]
    return real, imaginary


@kernel
def largest_change(n, seen, signal, every, step, x, state):
    """Largest change from one update to the next; the last one before the first is a turn older."""
    largest = 0.0
    real, imaginary = seen_at(n, seen, signal, every - step, state)
    if step == every:
        return 2.0 * abs(math.sin(0.5 * x)) * math.hypot(real, imaginary)
    before_r = real * math.cos(x) + imaginary * math.sin(x)
    before_i = imaginary * math.cos(x) - real * math.sin(x)
    k = 0
    while k < every:
        real, imaginary = seen_at(n, seen, signal, k, state)
        largest = max(largest, math.hypot(real - before_r, imaginary - before_i))
        before_r, before_i = real, imaginary
        k += step
    return largest


@kernel
def limiter_sizes(q, n, a, b, seen, every, count, xs, sizes, work, state):
    """Largest magnitude, over the ticks between two commands, of each signal in front of a limiter.

    At each angle per interval of the command; ``sizes`` holds a row of ``count`` numbers for each signal,
    then one for the rate of each, its change from update to update per second.  What a limit clamps beside
    its signal, an integral, counts as that signal.
    """
    for g in range(count):
        states_at(n, a, b, xs[g], work, state)
        for signal in range(SEEN):
            largest, step = 0.0, signal_interval(q, signal, every)
            k = 0
            while k < every:
                real, imaginary = seen_at(n, seen, signal, k, state)
                largest = max(largest, math.hypot(real, imaginary))
                k += step
            if signal < SHOWN:
                sizes[signal * count + g] = largest
                change = largest_change(n, seen, signal, every, step, xs[g], state)
                sizes[(SHOWN + signal) * count + g] = change / (step * q[layout.PERIOD])
            else:
                at = (CURRENT_COMMAND + signal - BESIDE_CURRENT) * count + g
                sizes[at] = max(sizes[at], largest)
