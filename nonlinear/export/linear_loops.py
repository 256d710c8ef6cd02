"""The sampled loops out of the running tick, and what stands in front of limiters; only for the live page.

Each update of the signal within one period of the loop has its own A, b, c; mostly there is one.  Where there
are more, the loop is periodic, as `actuator_lti.loops.periodic` has it: the fundamental of the closed loop is
the time-invariant system whose m-th part holds the response seen at the m-th update, and L = T/S is that
system with its feedback taken away.  Margins read from it are those of the fundamental; its poles are the
M-th roots of those of the true loop, so the verdict on stability is the truth.
"""

# mypy: disallow-untyped-defs=False
import math

from actuator_lti.batch._complex import copied
from actuator_lti.batch._eigen import eigenvalues
from actuator_lti.batch._linalg import balance
from actuator_lti.batch._resolvent import states_at
from actuator_lti.batch._response import evaluate
from actuator_lti.batch._run import one_loop
from nonlinear._kernels import layout
from nonlinear.export import linear
from nonlinear.export.linear_row import linear_row

KERNELS = True

MOST_PHASES = 32  # updates of the signal within one period
MOST_STATES = 160  # of all phases together
BLOCK = linear.MOST * (linear.MOST + 2)  # numbers of one phase: A, b, c
SIGNALS = ("w_ref", "i_ref", "u")
SHOWN = 3  # of them


def phases_of(p, q, s, io, stage, blocks, places, seen):
    """A, b, c of each phase into ``blocks``; the states, or what stands in the way."""
    # closed, but for the only phase of a loop that is cut: that one stays open
    linear_row(p, q)
    every, whole = linear.interval(q, stage), linear.repeats(q, stage)
    if every <= 0:
        return linear.NO_LOOP
    if whole > every * MOST_PHASES:
        return linear.TOO_LONG
    if not linear.prepared(q, s, stage):
        return linear.TOO_LONG
    n, angles = linear.listed(q, places)
    if n > linear.MOST:
        return linear.TOO_LONG
    cut = linear.cut_of(q, stage)
    for m in range(int(whole / every)):
        at = m * BLOCK
        if not linear.block(q, s, io, cut, m * every, every, places, n, angles, blocks, at, seen):
            return linear.LOST
        if whole > every and not linear.runs_closed(cut):
            for i in range(n):
                for j in range(n):
                    blocks[at + i * n + j] -= blocks[at + n * n + i] * blocks[at + n * n + n + j]
    return n


def spread(n, count, blocks, keep):
    """Mark, phase by phase, the states that the output sees and the input reaches."""
    total = n * count
    for m in range(count):
        at, after = m * BLOCK + n * n, (m + 1) * n if m + 1 < count else 0
        for i in range(n):
            keep[m * n + i] = 1.0 if blocks[at + n + i] != 0.0 else 0.0
            keep[total + after + i] = 1.0 if blocks[at + i] != 0.0 else 0.0
    changed = 1
    while changed > 0:
        changed = 0
        for m in range(count):
            after = (m + 1) * n if m + 1 < count else 0
            for i in range(n):
                for j in range(n):
                    if blocks[m * BLOCK + i * n + j] == 0.0:
                        continue
                    if keep[after + i] > 0.0 and keep[m * n + j] <= 0.0:
                        keep[m * n + j] = 1.0
                        changed = 1
                    if keep[total + m * n + j] > 0.0 and keep[total + after + i] <= 0.0:
                        keep[total + after + i] = 1.0
                        changed = 1
    kept = 0
    for k in range(total):
        there = keep[k] > 0.0 and keep[total + k] > 0.0
        keep[k] = float(kept) if there else -1.0  # its place
        kept += 1 if there else 0
    return kept


def joined(n, count, kept, blocks, keep, a, b, c):
    """A, b, c of all phases as one system, over the states that are kept."""
    for k in range(kept * kept):
        a[k] = 0.0
    for k in range(kept):
        b[k], c[k] = 0.0, 0.0
    for m in range(count):
        at, after = m * BLOCK, (m + 1) * n if m + 1 < count else 0
        for i in range(n):
            row = int(keep[after + i])
            if row >= 0:
                b[row] = blocks[at + n * n + i]
                for j in range(n):
                    if keep[m * n + j] >= 0.0:
                        a[row * kept + int(keep[m * n + j])] = blocks[at + i * n + j]
            if keep[m * n + i] >= 0.0:
                c[int(keep[m * n + i])] = blocks[at + n * n + n + i] / count


def assembled(p, q, s, io, stage, blocks, places, keep, seen, a, b, c):
    """A, b, c of a loop of the drive p; the number of states, or what stands in the way."""
    # q, s and io are rows of a second drive that is run here; q[PERIOD] and `interval` give the period
    n = phases_of(p, q, s, io, stage, blocks, places, seen)
    if n <= 0:
        return n
    count = int(linear.repeats(q, stage) / linear.interval(q, stage))
    kept = spread(n, count, blocks, keep)
    if kept > MOST_STATES:
        return linear.TOO_LONG
    joined(n, count, kept, blocks, keep, a, b, c)
    if stage != linear.ANSWER and (count > 1 or linear.runs_closed(linear.cut_of(q, stage))):
        for i in range(kept):
            for j in range(kept):
                a[i * kept + j] += b[i] * c[j]
    return kept


def lead_of(p, stage):
    """Feed-forward in front of a position loop as k_ff/(Kv T), NaN where it is more than that; of others 0.

    NaN as well where the stage has a law of one's own.
    """
    if p[layout.OWN_STAGE] == float(stage + 1):
        return math.nan
    if stage != linear.POSITION:
        return 0.0
    if p[layout.ELASTIC_DRIVE] > 0.0 and p[layout.RIGID] <= 0.0 and p[layout.OUTPUT_SENSOR] <= 0.0:
        return math.nan  # the loop feeds back another angle than the output's
    if p[layout.POSITION_INTEGRAL] != 0.0 or p[layout.DERIVATIVE] != 0.0:
        return math.nan
    if p[layout.ACCELERATION_FEEDFORWARD] != 0.0 or p[layout.COMMAND_FILTERS] > 0.0:
        return math.nan
    period = p[layout.EVERY_POSITION] * p[layout.PERIOD]
    return p[layout.FEEDFORWARD] / (p[layout.POSITION_GAIN] * period)


def figures(
    n, a, b, c, lead, time_figures, row, poles, points, stack, xs, rs, ss, work, state, exchanged,
    real, imaginary,
):  # fmt: skip
    """Figures of a loop that was assembled (see ``one_loop``); the points scanned, `LOST` without poles."""
    for side in range(2):  # the open loop's poles, then the closed loop's
        closed = 0.0 if math.isnan(lead) else float(side)
        for i in range(n):
            for j in range(n):
                work[i * n + j] = a[i * n + j] - closed * b[i] * c[j]
        if not eigenvalues(n, work, exchanged, state, real, imaginary):
            return linear.LOST
        copied(n, real, 0, poles, 2 * side * n)
        copied(n, imaginary, 0, poles, (2 * side + 1) * n)
    return one_loop(
        n, a, b, c, poles, lead, time_figures > 0, row, points, stack, xs, rs, ss, work, state, exchanged
    )


def stepped(n, h, b, c, lead, count, y, state, after):
    """Step response of a closed loop at its samples; h is A - I. Lead NaN: of A, b, c as they are."""
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


def responded(n, h, b, c, count, xs, rs, work, state, exchanged):
    """Response of a loop at angles per sample, as pairs."""
    for k in range(count):
        rr, ri, _slope_r, _slope_i = evaluate(n, h, b, c, xs[k], work, state, exchanged)
        rs[2 * k], rs[2 * k + 1] = rr, ri


def limiters_assembled(p, q, s, io, blocks, places, keep, seen, a, b, c):
    """A, b of the closed drive from its command, rows of ``seen`` (tick, signal): states, then d."""
    n = phases_of(p, q, s, io, linear.COMMAND, blocks, places, seen)
    if n <= 0:
        return n
    every = linear.interval(q, linear.COMMAND)
    if every > linear.MOST_TICKS:
        return linear.TOO_LONG
    for i in range(n):
        total = 0.0
        for k in range(every * linear.SEEN):
            total += abs(seen[k * (linear.MOST + 1) + i])
        blocks[n * n + n + i] = total
    kept = spread(n, 1, blocks, keep)
    joined(n, 1, kept, blocks, keep, a, b, c)
    for i in range(kept):
        c[i] = (
            1.0  # becomes what a state is multiplied by: rows of 1e9 beside 1e-9 cost elimination its digits
        )
    balance(kept, a, b, c)
    for k in range(every * linear.SEEN):
        for i in range(n):
            if keep[i] >= 0.0:
                at = int(keep[i])
                seen[k * (linear.MOST + 1) + at] = c[at] * seen[k * (linear.MOST + 1) + i]
    return kept


def signal_interval(q, signal, every):
    """Ticks between two updates of a signal in front of a limiter."""
    if signal == linear.VOLTAGE or signal == linear.BESIDE_VOLTAGE:
        return 1
    if (signal == linear.CURRENT_COMMAND or signal == linear.BESIDE_CURRENT) and q[layout.HAS_VELOCITY] > 0.0:
        return linear.speed_interval(q)
    return every


def seen_at(n, seen, signal, k, state):
    """A signal in front of a limiter at tick k, as a pair."""
    at = (k * linear.SEEN + signal) * (linear.MOST + 1)
    real, imaginary = seen[at + linear.MOST], 0.0
    for i in range(n):
        real += seen[at + i] * state[2 * i]
        imaginary += seen[at + i] * state[2 * i + 1]
    return real, imaginary


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


def limiter_sizes(q, n, a, b, seen, every, count, xs, sizes, work, state):
    """Largest magnitude over a command's ticks of each signal in front of a limiter, at each angle."""
    # sizes: a row for each signal, then one for its change from update to update per second; what a limit
    # clamps beside its signal, an integral, counts as that signal
    for g in range(count):
        states_at(n, a, b, b, False, xs[g], work, state)
        for signal in range(linear.SEEN):
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
