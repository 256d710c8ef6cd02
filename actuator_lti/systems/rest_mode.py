"""A mode at zero frequency that a loop holds twice: a controller's integrator before or behind a zero there.

With a spring at the load a motor that stands still is held by a torque that may have any value: the
integrator of the velocity PI holds the torque, the angle gives it back, and the speed shows neither. On
paper the pole of the PI is cancelled by the zero of the plant; rounding leaves both beside each other, with a
residue of 1e-16 over a pole at 1e-17, which no later computation can tell from a slow loop. Here it is known,
and taken out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

System = tuple[np.ndarray, np.ndarray, np.ndarray]

LEAST = (1e-9, 1e-12, 1e-15)  # of the largest: a state of less is zero, if the equations then hold as well
ROUNDED = 1e-11  # over its terms, what is left of a sum that is zero: matrix exponentials lose some digits


def without_rest_mode(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, at: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Take out a mode at zero frequency that the output does not see, or the input does not drive.

    It is hidden where A v = ``at`` v and C v = 0 hold within the rounding of the entries (or the same of the
    transposed system). Then x - v x_j, j an integrator with v_j = 1, obeys equations without x_j.

    Parameters
    ----------
    A, B, C : ndarray, shapes (n, n), (n, 1), (1, n)
    at : float
        The pole at zero frequency: 1 for a sampled system, 0 for a continuous one.

    Returns
    -------
    A, B, C : ndarray
        Without that mode, or untouched.
    kept : ndarray of bool, shape (n,)
        Which states remain.
    """
    ((A, B, C),), kept = without_common_rest_mode([(A, B, C)], at)
    return A, B, C, kept


def without_common_rest_mode(
    systems: Sequence[System], at: float, *, alone: bool = False
) -> tuple[list[System], np.ndarray]:
    """Take out a mode that several systems on the same states, one tick after the other, all hide.

    Parameters
    ----------
    systems : sequence of (A, B, C)
    at : float
    alone : bool
        Also an integrator that moves nothing else and is not seen, or is not driven.

    Returns
    -------
    systems : list of (A, B, C)
    kept : ndarray of bool, shape (n,)
    """
    n = systems[0][0].shape[0]
    As, Bs, Cs = (np.stack(part) for part in zip(*systems, strict=True))
    finite = all(np.isfinite(part).all() for part in (As, Bs, Cs))
    own = (np.diagonal(As, axis1=1, axis2=2) == at).all(axis=0) if finite else np.zeros(n, dtype=bool)
    integrators = np.flatnonzero(own) if n > 1 else np.empty(0, dtype=int)
    entries = (As != 0.0).any(axis=0)
    for j in sorted(integrators, key=lambda j: np.count_nonzero(entries[j])):
        v = _at_rest(As, Cs, at, int(j), alone)
        if v is not None:
            o = np.arange(n) != j
            return [
                (A[np.ix_(o, o)] - v[o, None] * A[j, o], B[o] - v[o, None] * B[j], C[:, o])
                for A, B, C in systems
            ], o
    for j in sorted(integrators, key=lambda j: np.count_nonzero(entries[:, j])):
        w = _at_rest(As.transpose(0, 2, 1), Bs.transpose(0, 2, 1), at, int(j), alone)
        if w is not None:
            o = np.arange(n) != j
            return [
                (A[np.ix_(o, o)] - A[o, j][:, None] * w[o], B[o], C[:, o] - C[:, [j]] * w[o])
                for A, B, C in systems
            ], o
    return list(systems), np.ones(n, dtype=bool)


def _at_rest(As: np.ndarray, Cs: np.ndarray, at: float, j: int, alone: bool) -> np.ndarray | None:
    """The vector v with v_j = 1, A v = ``at`` v and C v = 0 within rounding; ``None`` where there is none."""
    n = As.shape[-1]
    o = np.arange(n) != j
    rows = (As - at * np.eye(n)).reshape(-1, n)
    allowed = (np.abs(As) + abs(at) * np.eye(n)).reshape(-1, n)
    c = Cs.reshape(-1, n)
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
