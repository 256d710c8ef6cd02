"""Which of many designs keep their figures: those whose loop double precision can follow.

An unstable inner loop that runs many times within one update of the outer one leaves entries of 1e12 and more
in the outer loop's matrices, which nearly cancel in its response. Every crossover of such a design, and the
response at some angles between, must stand out from its own rounding errors; else the design has no figures.
Nor has it any where its largest pole lies on the unit circle but for rounding, which would decide about
stability, or where the number of its gain crossovers does not fit the gain at both ends, because one lies
below the angles that were scanned.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from actuator_lti.batch._figures import (
    DC_GAIN,
    FIRST_GAIN,
    FIRST_PHASE,
    GAIN_CROSSOVERS,
    LISTED,
    PHASE_CROSSOVERS,
    RADIUS,
    STABLE,
)
from actuator_lti.margins.trust import told_from_zero
from actuator_lti.systems.rest_mode import without_rest_mode

AT_BORDER = 1e-10  # of the largest pole from the unit circle, or T(0) from 1/2: rounding decides
_GROWTH = 10.0  # of an open-loop pole in one sample: below it the entries stay small
_MOST_ERROR = 1e-10  # relative, of the response at a crossover: the margins are then good to 1e-8
_BETWEEN = (0.03, 0.3, 1.0, 2.5)


def withhold(A: np.ndarray, B: np.ndarray, C: np.ndarray, poles: np.ndarray, rows: np.ndarray) -> None:
    """Take the figures away that rounding decides: NaN in all columns, counts 0.

    Parameters
    ----------
    A, B, C : ndarray, shapes (count, n, n), (count, n), (count, n)
        Open loops.
    poles : ndarray, shape (count, 4, n)
        Real and imaginary parts of the open loop's, then of the closed loop's.
    rows : ndarray, shape (count, columns)
        Figures, changed in place.
    """
    with np.errstate(invalid="ignore"):
        fast = np.hypot(poles[:, 0], poles[:, 1]).max(axis=1, initial=0.0) > _GROWTH
    chosen = np.flatnonzero(fast)
    if chosen.size:
        lost = chosen[_lost(A[chosen], B[chosen], C[chosen], rows[chosen])]
        rows[lost] = np.nan
    rows[np.abs(rows[:, RADIUS] - 1.0) < AT_BORDER] = np.nan
    rows[_odd_crossovers(A, B, C, rows)] = np.nan
    none = np.isnan(rows[:, STABLE])
    rows[np.ix_(none, [GAIN_CROSSOVERS, PHASE_CROSSOVERS])] = 0.0


def _odd_crossovers(A: np.ndarray, B: np.ndarray, C: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Which designs have a number of gain crossovers that does not fit the gain at both ends."""
    above_one = rows[:, DC_GAIN] > 0.5  # |L(0)| > 1 from T(0) = L(0)/(1 + L(0)), also with a pole there
    either = np.abs(rows[:, DC_GAIN] - 0.5) < AT_BORDER  # |L(0)| = 1 but for rounding: both numbers fit
    suspect = np.flatnonzero(((rows[:, GAIN_CROSSOVERS] % 2.0 == 1.0) != above_one) & ~either)
    suspect = suspect[np.isfinite(rows[suspect, DC_GAIN])]
    at_nyquist = [abs(_response(A[k], B[k], C[k], -1.0)) for k in suspect]
    return suspect[~(np.array(at_nyquist) > 1.0)]


def _response(A: np.ndarray, b: np.ndarray, c: np.ndarray, z: float) -> float:
    """L at a real z; infinite where it has a pole there."""
    try:
        return float(c @ np.linalg.solve(z * np.eye(len(A)) - A, b))
    except np.linalg.LinAlgError:
        return np.inf


def _lost(A: np.ndarray, B: np.ndarray, C: np.ndarray, rows: np.ndarray) -> np.ndarray:
    count = len(A)
    lists = [rows[:, first : first + 2 * LISTED : 2] for first in (FIRST_GAIN, FIRST_PHASE)]
    angles = np.hstack([*lists, np.broadcast_to(_BETWEEN, (count, len(_BETWEEN)))])
    asked = ~np.isnan(angles)
    points = np.exp(1j * np.where(asked, angles, 1.0))
    with np.errstate(all="ignore"):
        told = np.array([_told(*design) for design in zip(A, B, C, points, strict=True)])
    return ~((told >= 1.0 / _MOST_ERROR) | ~asked).all(axis=1)


def _told(A: np.ndarray, B: np.ndarray, C: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How many of its own rounding errors the response of one design is; 0 where it has a pole there.

    At zero frequency it is that of the loop without a mode at rest that it does not show, as its figures are
    (`_at_dc`).
    """
    result = np.zeros(points.shape)
    here = points == 1.0
    for chosen in (here, ~here):
        a, b, c = A, B, C
        if chosen is here and here.any():
            a, column, row, _ = without_rest_mode(A, B[:, None], C[None], 1.0)
            b, c = column[:, 0], row[0]
        with suppress(np.linalg.LinAlgError):
            result[chosen] = told_from_zero(a, b, c, np.zeros(()), points[chosen])
    return result
