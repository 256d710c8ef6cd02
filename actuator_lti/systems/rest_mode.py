"""A mode at zero frequency that a loop holds twice: a controller's integrator before or behind a zero there.

With a spring at the load a motor that stands still is held by a torque that may have any value: the
integrator of the velocity PI holds the torque, the angle gives it back, and the speed shows neither. On
paper the pole of the PI is cancelled by the zero of the plant; rounding leaves both beside each other, with a
residue of 1e-16 over a pole at 1e-17, which no later computation can tell from a slow loop. Here it is known,
and taken out.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from actuator_lti.systems.resolvent import balanced

System = tuple[np.ndarray, np.ndarray, np.ndarray]

LEAST = (1e-9, 1e-12, 1e-15)  # of the largest: a state of less is zero, if the equations then hold as well
ROUNDED = 1e-11  # over its terms, what is left of a sum that is zero: matrix exponentials lose some digits


def without_rest_mode(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, at: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Take out a mode at zero frequency that the output does not see, or the input does not drive.

    It is hidden where A v = ``at`` v and C v = 0 hold within the rounding of the entries (or the same of the
    transposed system), ``at`` 1 for a sampled system, 0 for a continuous one. Then x - v x_j with v_j = 1
    obeys equations without x_j. Returned is also which states are kept, bool (n,).
    """
    ((A, B, C),), kept = without_common_rest_mode([(A, B, C)], at)
    return A, B, C, kept


def without_common_rest_mode(
    systems: Sequence[System], at: float, *, alone: bool = False
) -> tuple[list[System], np.ndarray]:
    """Take out a mode that systems on the same states, one tick after the other and round again, all hide.

    It comes back to where it was after all of them; on the way it may change: what a stage has counted since
    a slower one last read it does. ``alone``: also an integrator that moves nothing else and is not seen, or
    is not driven.
    """
    for turned in (False, True):  # not seen; not driven: the same of the transposed systems, backwards
        tried = [(A.T, C.T, B.T) for A, B, C in reversed(systems)] if turned else list(systems)
        found = _own(tried, at, alone)
        if found is not None:
            j, v = found
            o = np.arange(v.shape[1]) != j
            left = [(A[np.ix_(o, o)] - np.outer(w[o], A[j, o]), B[o] - np.outer(w[o], B[j]), C[:, o])
                    for (A, B, C), w in zip(tried, np.roll(v, -1, axis=0), strict=True)]  # fmt: skip
            return [(A.T, C.T, B.T) for A, B, C in reversed(left)] if turned else left, o
    return list(systems), np.ones(len(systems[0][0]), dtype=bool)


def without_rest_modes(systems: list[System]) -> tuple[list[System], np.ndarray]:
    """Sampled systems without the modes at rest that no tick shows, or moves: no gain moves them either.

    A velocity controller's integral under a load that is a spring is one. And which states are kept.
    """
    left = np.arange(len(systems[0][0]))
    while left.size:
        systems, kept = without_common_rest_mode(systems, 1.0, alone=True)
        if kept.all():
            break
        left = left[kept]
    return systems, left


def _own(systems: Sequence[System], at: float, alone: bool) -> tuple[int, np.ndarray] | None:
    """A mode at rest over the state that is the largest part of it, a row a tick; ``None`` if none.

    Any integrator may have found it (over several ticks any state: a held one is written anew in one of
    them), but over one that takes part by 1e-10 only it would leave the difference of large numbers.
    """
    As, Cs = (np.stack([each[k] for each in systems]) for k in (0, 2))
    if As.shape[1] < 2 or not (np.isfinite(As).all() and np.isfinite(Cs).all()):
        return None
    holds = (np.diagonal(As, axis1=1, axis2=2) == at).all(axis=0)
    round_trip = _round_trip(As, at, holds)
    seen = np.vstack([C @ over for C, over in zip(Cs, round_trip.before, strict=True)])
    integrators = np.flatnonzero(holds | (len(As) > 1))
    if not integrators.size or _none_is_at_rest(round_trip, seen):
        return None
    found = [v for j in integrators if (v := _at_rest(round_trip, seen, int(j), alone)) is not None]
    if not found:
        return None
    parts = np.abs(found) / balanced(As[0])[1]
    k, largest = np.unravel_index(np.argmax(parts / parts.max(axis=1, keepdims=True)), parts.shape)
    j = int(largest)
    v = _on_its_way(As, found[k])
    return (j, v / v[:, [j]]) if v[:, j].all() else None


class _RoundTrip(NamedTuple):
    """All ticks together: what is before each of them, shape (M, n, n), of what was before the first."""

    before: np.ndarray
    change: np.ndarray  # what all of them change, shape (n, n)
    terms: np.ndarray  # size of what that is the sum of


def _round_trip(As: np.ndarray, at: float, holds: np.ndarray) -> _RoundTrip:
    """``holds``: integrators in every tick: of those only what they sum is a term, not themselves."""
    one, first = np.eye(As.shape[1]), As[0] - at * np.eye(As.shape[1])
    before, change, sums, whole = [one], first, np.abs(first), np.abs(As[0])  # nothing times one: 1300 states
    for last, A in pairwise(As):
        over = last if len(before) == 1 else last @ before[-1]
        change, sums = change + (A - at * one) @ over, sums + np.abs(A - at * one) @ np.abs(over)
        whole = np.abs(A) @ np.abs(over)
        before.append(over)
    return _RoundTrip(np.array(before), change, np.where(holds[:, None], sums, whole + abs(at) * one))


def _on_its_way(As: np.ndarray, v: np.ndarray) -> np.ndarray:
    """The mode before each tick; what rounding leaves of zero is zero."""
    way = [v]
    for A in As[:-1]:
        after = A @ way[-1]
        way.append(np.where(np.abs(after) > ROUNDED * (np.abs(A) @ np.abs(way[-1])), after, 0.0))
    return np.array(way)


def _none_is_at_rest(ticks: _RoundTrip, c: np.ndarray) -> bool:
    """Whether nothing can pass `_at_rest`, whatever the state: one look in the place of one for each of them.

    Who passes has |M u| <= r T |u|, row by row, and so in any scales of rows and states a ratio of norms of M
    of no more than r |T|: the least singular value says that there is none.
    """
    rows, terms = np.vstack([ticks.change, c]), np.vstack([ticks.terms, np.abs(c)])
    size = np.ones(rows.shape[1])
    for _ in range(3):  # all terms of one size
        weight = (terms * size).max(axis=1, keepdims=True)
        weight = np.where(weight > 0.0, weight, 1.0)
        size = np.abs(rows / weight).max(axis=0)
        size = 1.0 / np.where(size > 0.0, size, 1.0)
    least = np.linalg.svd(rows / weight * size, compute_uv=False)[-1]
    return bool(least > ROUNDED * np.linalg.norm(terms / weight * size))


def _at_rest(ticks: _RoundTrip, c: np.ndarray, j: int, alone: bool) -> np.ndarray | None:
    """The vector v with v_j = 1 that nothing changes, C v = 0, within rounding; ``None`` if there is none."""
    rows, allowed = ticks.change, ticks.terms
    n = len(rows)
    o = np.arange(n) != j
    v = np.zeros(n)
    v[j] = 1.0
    largest = np.abs(rows).max(axis=1)
    weight = largest = np.where(largest > 0.0, largest, 1.0)
    for _ in range(3):  # each row over the size of its terms, once the sizes of v are known
        scaled = rows / weight[:, None]
        size = np.abs(scaled[:, o]).max(axis=0)
        size = 1.0 / np.where(size > 0.0, size, 1.0)  # of a state: what makes such a term
        seen = np.abs(c[:, o]) @ size
        both = np.vstack([scaled, c / np.where(seen > 0.0, seen, 1.0)[:, None]])
        v[o] = np.linalg.lstsq(both[:, o] * size, -both[:, j], rcond=None)[0] * size
        weight = np.maximum(allowed @ np.abs(v), 1e-30 * largest)
    for least in LEAST:
        u = np.where(np.abs(v) > least * np.abs(v).max(), v, 0.0)
        at_rest = (np.abs(rows @ u) <= ROUNDED * (allowed @ np.abs(u))).all()
        unseen = (np.abs(c @ u) <= ROUNDED * (np.abs(c) @ np.abs(u))).all()
        if at_rest and unseen and u[j] and (alone or u[o].any()):  # without j it is another's mode
            return u
    return None
