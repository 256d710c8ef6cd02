"""Every crossing of a factored loop between places, compiled: nothing left out.

Intervals are halved until in each of them the bounds say that the loop stays off the line, or moves over it
one way.
"""

# mypy: disallow-untyped-defs=False
import math

from ._factors import FACTOR, MOST, SLACK, bounded, evaluated, halved, one_way, root, slot

KERNELS = True

DONE, FULL, TOO_NEAR = range(3)  # status
INTERVALS, GAINS, REALS, FAR, TURNS, RATE, WHERE, LEAVING, FOUND = range(9)  # places in ``found``
KNOWN = 7  # numbers of an interval: w, gain and phase at its beginning, then their least, then their most
CIRCLE, GAIN_LEVEL, PHASE_LEVEL = -1, 0, 1  # what is looked for
DEEPEST = 110
NARROWEST = 1e-14
FAR_LOG = 23.025850929940457  # 200 dB
ON_AXIS = 1e-9  # rad


def half_turns(phase):
    """How many odd multiples of pi lie below."""
    return float(math.floor((phase + math.pi) / (2.0 * math.pi)))


def _far(bounds):
    """Whether the gain stays beyond 200 dB, up or down: its crossings of the real axis are only counted."""
    return bounds[MOST] < -FAR_LOG or bounds[0] > FAR_LOG


def _clear(kind, level, listed_to, slack, low, bounds):
    if kind != CIRCLE:
        return one_way(bounds, kind) or bounds[kind] > level or bounds[MOST + kind] < level
    off_circle = bounds[0] > slack or bounds[MOST] < -slack
    if not one_way(bounds, 0) and not off_circle:
        return False
    if low >= listed_to:  # only counted, where the gain is above one
        if off_circle:
            return True
    elif one_way(bounds, 1) or _far(bounds):
        return True
    return half_turns(bounds[1] - slack) == half_turns(bounds[MOST + 1] + slack)


def _turns_before(phase, found):
    """Half turns below a phase; one that hardly leaves the real axis of zero frequency has left it."""
    if found[LEAVING] > 0.0 and abs(math.sin(phase)) < ON_AXIS:
        phase += math.copysign(2.0 * ON_AXIS, found[RATE])
    return half_turns(phase)


def _levels(m, factors, kind, level, parts, right, room, gains, found):
    """Keep the one place of the interval at which gain or phase passes a level."""
    first, last = parts[4 * m + kind] > level, parts[right + 4 * m + kind] > level
    if (first and last) or (not first and not last):
        return DONE
    count = int(found[GAINS])
    if count == room:
        return FULL
    gains[count] = root(m, factors, kind, level, parts, 0, right, right + slot(m))
    found[GAINS] += 1.0
    return DONE


def _turned(m, factors, listed_to, parts, right, bounds, room, reals, found):
    """Keep every place of the interval at which the phase passes an odd multiple of pi, or count them."""
    low = parts[4 * m + 4]
    first = _turns_before(parts[4 * m + 1], found)
    step = _turns_before(parts[right + 4 * m + 1], found) - first
    if abs(math.sin(parts[right + 4 * m + 1])) >= ON_AXIS:
        found[LEAVING] = 0.0
    if step == 0.0:
        return DONE
    if low >= listed_to or _far(bounds):
        if low < listed_to:
            found[FAR] += abs(step)
        if bounds[0] > 0.0:
            found[TURNS] += step
        return DONE
    for number in range(int(abs(step))):
        count = int(found[REALS])
        if count == room:
            return FULL
        turns = first + 1.0 + number if step > 0.0 else first - number
        level = 2.0 * math.pi * turns - math.pi
        reals[2 * count] = root(m, factors, 1, level, parts, 0, right, right + slot(m))
        reals[2 * count + 1] = step
        found[REALS] += 1.0
    return DONE


def _kept(m, parts, right, bounds, known, found):
    at = KNOWN * int(found[INTERVALS])
    known[at], known[at + 1], known[at + 2] = parts[4 * m + 4], parts[4 * m], parts[4 * m + 1]
    known[at + 3], known[at + 4] = bounds[0], bounds[1]
    known[at + 5], known[at + 6] = bounds[MOST], bounds[MOST + 1]
    to = right + 4 * m
    known[at + 7], known[at + 8], known[at + 9] = parts[to + 4], parts[to], parts[to + 1]
    found[INTERVALS] += 1.0


def search(
    m, factors, kind, level, listed_to, count, edges, room, known, gains, reals, found,
    parts, bounds,
):  # fmt: skip
    """Find what is looked for from the first to the last of the edges, places among them; the status.

    ``kind`` is `CIRCLE` (gain one, and the negative real axis up to ``listed_to``), or whether gain or phase
    passes ``level``. ``known`` has room for ``room`` intervals and one end, ``gains`` for as many places,
    ``reals`` for as many with the way in which the phase turns there. ``parts`` lends `DEEPEST` + 2 slots.
    """
    size = slot(m)
    evaluated(m, factors, edges[0], parts, 0)
    found[RATE] = parts[4 * m + 3]
    found[LEAVING] = 1.0 if edges[0] == 0.0 else 0.0
    for n in range(1, count):
        if edges[n] == edges[n - 1]:
            continue
        evaluated(m, factors, edges[n], parts, size)
        depth = 1
        while depth > 0:
            right = size * depth
            low, high = parts[size - 1], parts[right + size - 1]
            bounded(m, factors, parts, 0, right, bounds)
            if not _clear(kind, level, listed_to, factors[FACTOR * m + SLACK], low, bounds):
                found[WHERE] = low
                if depth == DEEPEST or high - low <= NARROWEST * high:
                    return TOO_NEAR
                evaluated(m, factors, halved(low, high), parts, right + size)
                depth += 1
                continue
            if int(found[INTERVALS]) == room:
                return FULL
            one = level if kind != CIRCLE else 0.0
            status = _levels(m, factors, max(kind, 0), one, parts, right, room, gains, found)
            if kind == CIRCLE and status == DONE:
                status = _turned(m, factors, listed_to, parts, right, bounds, room, reals, found)
            if status != DONE:
                return status
            _kept(m, parts, right, bounds, known, found)
            for k in range(size):
                parts[k] = parts[right + k]
            depth -= 1
    return DONE
