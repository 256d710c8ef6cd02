"""A mode at zero frequency that a loop holds twice: a controller's integrator before or behind a zero there.

With a spring at the load a motor that stands still is held by a torque that may have any value: the
integrator of the velocity PI holds the torque, the angle gives it back, and the speed shows neither. On
paper the pole of the PI is cancelled by the zero of the plant; rounding leaves both beside each other, with a
residue of 1e-16 over a pole at 1e-17, which no later computation can tell from a slow loop. Here it is known,
and taken out.
"""

from __future__ import annotations

import numpy as np

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
    n = A.shape[0]
    finite = all(np.isfinite(part).all() for part in (A, B, C))
    integrators = np.flatnonzero(A.diagonal() == at) if n > 1 and finite else np.empty(0, dtype=int)
    for j in sorted(integrators, key=lambda j: np.count_nonzero(A[j])):
        v = _at_rest(A, C, at, int(j))
        if v is not None:
            o = np.arange(n) != j
            return A[np.ix_(o, o)] - v[o, None] * A[j, o], B[o] - v[o, None] * B[j], C[:, o], o
    for j in sorted(integrators, key=lambda j: np.count_nonzero(A[:, j])):
        w = _at_rest(A.T, B.T, at, int(j))
        if w is not None:
            o = np.arange(n) != j
            return A[np.ix_(o, o)] - A[o, j][:, None] * w[o], B[o], C[:, o] - C[:, [j]] * w[o], o
    return A, B, C, np.ones(n, dtype=bool)


def _at_rest(A: np.ndarray, C: np.ndarray, at: float, j: int) -> np.ndarray | None:
    """The vector v with v_j = 1, A v = ``at`` v and C v = 0 within rounding; ``None`` where there is none."""
    n = len(A)
    o = np.arange(n) != j
    rows, c = A - at * np.eye(n), C[0]
    allowed = np.abs(A) + abs(at) * np.eye(n)
    v = np.zeros(n)
    v[j] = 1.0
    largest = np.abs(rows).max(axis=1)
    weight = largest = np.where(largest > 0.0, largest, 1.0)
    for _ in range(3):  # each row over the size of its terms, once the sizes of v are known
        scaled = rows / weight[:, None]
        size = np.abs(scaled[:, o]).max(axis=0)
        size = 1.0 / np.where(size > 0.0, size, 1.0)  # of a state: what makes such a term
        unseen = c / ((np.abs(c[o]) @ size) or 1.0)
        both = np.vstack([scaled, unseen])
        v[o] = np.linalg.lstsq(both[:, o] * size, -both[:, j], rcond=None)[0] * size
        weight = np.maximum(allowed @ np.abs(v), 1e-30 * largest)
    for least in LEAST:
        u = np.where(np.abs(v) > least * np.abs(v).max(), v, 0.0)
        at_rest = (np.abs(rows @ u) <= ROUNDED * (allowed @ np.abs(u))).all()
        if at_rest and abs(c @ u) <= ROUNDED * (np.abs(c) @ np.abs(u)) and u[o].any():
            return u
    return None
