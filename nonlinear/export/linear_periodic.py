"""Periodic loops as `actuator_lti.loops.periodic` has them, out of the running tick; emitted only.

Each update of the signal within one period has its own A, b, c.  The fundamental of the closed loop is the
time-invariant system whose m-th part holds the response seen at the m-th update; L = T/S is that system with
its feedback taken away.  Margins read from it are those of the fundamental; its poles are the M-th roots of
those of the true loop, so the verdict on stability is the truth.
"""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

from actuator_lti.compiled.kernel import kernel
from nonlinear.export.linear import (
    LOST,
    MOST,
    NO_LOOP,
    TOO_LONG,
    block,
    cut_of,
    interval,
    listed,
    prepared,
    repeats,
    runs_closed,
)
from nonlinear.export.linear_row import linear_row

MOST_PHASES = 32  # updates of the signal within one period
MOST_STATES = 160  # of all phases together
BLOCK = MOST * (MOST + 2)  # numbers of one phase: A, b, c


@kernel
def phases_of(p, q, s, io, stage, blocks, places, column, a, b, c):
    """Closed A, b, c of each phase into ``blocks``; the states, or what stands in the way."""
    linear_row(p, q)
    every, whole = interval(q, stage), repeats(q, stage)
    if every <= 0:
        return NO_LOOP
    if whole > every * MOST_PHASES:
        return TOO_LONG
    ready = prepared(q, s, stage)
    if ready == 0:
        return TOO_LONG
    n, angles = listed(q, places)
    if n > MOST:
        return TOO_LONG
    cut = cut_of(q, stage)
    for m in range(int(whole / every)):
        done = block(q, s, io, cut, m * every, every, places, n, angles, a, b, c, column)
        if done == 0:
            return LOST
        at = m * BLOCK
        for i in range(n):
            for j in range(n):
                closing = 0.0 if runs_closed(cut) else b[i] * c[j]
                blocks[at + i * n + j] = a[i * n + j] - closing
            blocks[at + n * n + i], blocks[at + n * n + n + i] = b[i], c[i]
    return n


@kernel
def next_phase(m, count):
    """The phase after one."""
    return m + 1 if m + 1 < count else 0


@kernel
def spread(n, count, blocks, keep):
    """Mark, phase by phase, the states that the output sees and the input reaches."""
    total = n * count
    for m in range(count):
        at = m * BLOCK + n * n
        for i in range(n):
            keep[m * n + i] = 1.0 if blocks[at + n + i] != 0.0 else 0.0
            keep[total + next_phase(m, count) * n + i] = 1.0 if blocks[at + i] != 0.0 else 0.0
    changed = 1
    while changed > 0:
        changed = 0
        for m in range(count):
            after = next_phase(m, count) * n
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


@kernel
def fundamental(n, count, kept, blocks, keep, a, b, c):
    """A, b, c of the fundamental's open loop from closed phases, over the states that are kept."""
    for k in range(kept * kept):
        a[k] = 0.0
    for k in range(kept):
        b[k], c[k] = 0.0, 0.0
    for m in range(count):
        at, after = m * BLOCK, next_phase(m, count) * n
        for i in range(n):
            row = int(keep[after + i])
            if row >= 0:
                b[row] = blocks[at + n * n + i]
                for j in range(n):
                    if keep[m * n + j] >= 0.0:
                        a[row * kept + int(keep[m * n + j])] = blocks[at + i * n + j]
            if keep[m * n + i] >= 0.0:
                c[int(keep[m * n + i])] = blocks[at + n * n + n + i] / count
    for i in range(kept):
        for j in range(kept):
            a[i * kept + j] += b[i] * c[j]


@kernel
def periodic_assembled(p, q, s, io, stage, blocks, places, column, keep, a, b, c):
    """A, b, c of the fundamental of a periodic loop; the number of states, or what stands in the way."""
    n = phases_of(p, q, s, io, stage, blocks, places, column, a, b, c)
    if n <= 0:
        return n
    count = int(repeats(q, stage) / interval(q, stage))
    kept = spread(n, count, blocks, keep)
    if kept > MOST_STATES:
        return TOO_LONG
    fundamental(n, count, kept, blocks, keep, a, b, c)
    return kept
