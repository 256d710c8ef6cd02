"""Zero frequency itself, which the compiled scan of angles only comes near to."""

from __future__ import annotations

import numpy as np

from actuator_lti.batch._figures import DC_GAIN, FINAL, FIRST_PHASE, LISTED, MODULUS, MODULUS_X
from actuator_lti.systems.rest_mode import without_rest_mode


def at_rest(A: np.ndarray, B: np.ndarray, C: np.ndarray, rows: np.ndarray) -> None:
    """Correct the figures at zero frequency: the margin listed there, and the distance |1 + L(0)|.

    The compiled code brings A to Hessenberg form first, which keeps 16 digits of A but not of slow poles, the
    differences of A and the identity: behind a spring L(0) loses half of its digits. Here A is taken as it
    is, without a mode at rest that the loop does not show.

    Parameters
    ----------
    A, B, C : ndarray, shapes (count, n, n), (count, n), (count, n)
        Open loops.
    rows : ndarray, shape (count, columns)
        Figures, changed in place.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        # a gain that is nothing beside the peak is not quoted, and its final value is zero: L(0) is zero too
        closed = np.where(np.isnan(rows[:, DC_GAIN]) & (rows[:, FINAL] == 0.0), 0.0, rows[:, DC_GAIN])
        distance = 1.0 / np.abs(1.0 - closed)
    angles = rows[:, FIRST_PHASE : FIRST_PHASE + 2 * LISTED : 2]
    for k, j in np.argwhere(angles == 0.0):
        L0 = _at_rest(A[k], B[k], C[k])
        if L0 is not None and L0 < 0.0:
            rows[k, FIRST_PHASE + 2 * j + 1], distance[k] = -1.0 / L0, abs(1.0 + L0)
    nearer = distance < rows[:, MODULUS]
    rows[nearer, MODULUS], rows[nearer, MODULUS_X] = distance[nearer], 0.0


def _at_rest(A: np.ndarray, b: np.ndarray, c: np.ndarray) -> float | None:
    a, B, C, _ = without_rest_mode(A, b[:, None], c[None], 1.0)
    try:
        return float(C[0] @ np.linalg.solve(np.eye(len(a)) - a, B[:, 0]))
    except np.linalg.LinAlgError:
        return None
