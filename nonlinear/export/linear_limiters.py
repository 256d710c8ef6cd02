"""What stands in front of each limiter under a sinusoidal command; emitted only, for the live page."""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import math

from actuator_lti.batch._resolvent import states_at
from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout
from nonlinear.export import linear
from nonlinear.export.linear import MOST, SEEN, interval, speed_interval
from nonlinear.export.linear_loops import joined, phases_of, spread

SIGNALS = ("w_ref", "i_ref", "u")
SHOWN = 3


@kernel
def limiters_assembled(p, q, s, io, blocks, places, keep, seen, a, b, c):
    """A and b of the closed drive from its command, and rows of ``seen`` (tick, signal): states, then d.

    The number of states, or what stands in the way.
    """
    n = phases_of(p, q, s, io, linear.COMMAND, blocks, places, seen)
    if n <= 0:
        return n
    every = interval(q, linear.COMMAND)
    if every > linear.MOST_TICKS:
        return linear.TOO_LONG
    for i in range(n):
        total = 0.0
        for k in range(every * SEEN):
            total += abs(seen[k * (MOST + 1) + i])
        blocks[n * n + n + i] = total
    kept = spread(n, 1, blocks, keep)
    joined(n, 1, kept, blocks, keep, a, b, c)
    for k in range(every * SEEN):
        for i in range(n):
            if keep[i] >= 0.0:
                seen[k * (MOST + 1) + int(keep[i])] = seen[k * (MOST + 1) + i]
    return kept


@kernel
def signal_interval(q, signal, every):
    """Ticks between two updates of a signal in front of a limiter."""
    if signal == linear.VOLTAGE or signal == linear.BESIDE_VOLTAGE:
        return 1
    if (signal == linear.CURRENT_COMMAND or signal == linear.BESIDE_CURRENT) and q[layout.HAS_VELOCITY] > 0.0:
        return speed_interval(q)
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
        states_at(n, a, b, b, False, xs[g], work, state)
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
                at = (linear.CURRENT_COMMAND + signal - linear.BESIDE_CURRENT) * count + g
                sizes[at] = max(sizes[at], largest)
