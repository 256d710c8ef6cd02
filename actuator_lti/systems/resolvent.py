"""(p - A)^-1 B and C (p - A)^-1 B + D at many complex points p: s = jw, or z = exp(jwT)."""

from collections.abc import Callable
from typing import Any

import numpy as np

HALVED, MOST = 7, 3000  # times that an interval too long on paper is halved, and points at which that ends
LARGE = 32  # states and points from which on a Schur form is quicker than to solve at each
_ENTRIES = 1 << 15  # of the matrices solved in one call: what the cache holds


def states_at(A: np.ndarray, B: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(p - A)^-1 B, shape (K, n, m), for A (n, n), B (n, m) or (K, n, m) and points (K,); NaN at a pole.

    The states are scaled by powers of two first: of ones of very different size a small response, behind a
    soft spring say, would keep few digits.
    """
    A, scale = balanced(A)
    right = np.broadcast_to(B / scale[:, None], (len(points), *B.shape[-2:]))
    if min(len(A), len(points)) >= LARGE and np.isfinite(A).all():
        return _by_schur_form(A, right, points) * scale[:, None]
    result = np.empty(right.shape, dtype=complex)
    own = np.arange(len(A))
    some = max(_ENTRIES // max(A.size, 1), 1)  # points at once
    for start in range(0, len(points), some):
        part = slice(start, start + some)
        matrix = np.repeat(-A.astype(complex)[None], len(points[part]), axis=0)
        matrix[:, own, own] += points[part, None]
        result[part] = solved_at(matrix, right[part])
    return result * scale[:, None]


def _by_schur_form(A: np.ndarray, right: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(p - A)^-1 right with A = Q T Q^H: n^2 operations a point for n^3. Refined once, as in `solved_at`."""
    from scipy.linalg import schur

    T, Q = schur(A, output="complex")

    def solved(wanted: np.ndarray) -> np.ndarray:
        x = np.tensordot(Q.conj().T, wanted, (1, 1))  # states first: a row of all points is one product
        for row in reversed(range(len(A))):
            x[row] += np.tensordot(T[row, row + 1 :], x[row + 1 :], 1)
            x[row] /= (points - T[row, row])[:, None]
        return np.tensordot(Q, x, 1).transpose(1, 0, 2)

    with np.errstate(divide="ignore", invalid="ignore"):  # at a pole
        found = solved(right)
        return found + solved(right - (points[:, None, None] * found - A @ found))


def balanced(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """D^-1 A D with rows and columns of like size, and the diagonal of D."""
    from scipy.linalg import matrix_balance

    if not A.size or not np.isfinite(A).all():
        return A, np.ones(len(A))
    with np.errstate(invalid="ignore"):  # of the order, which is not asked for, made of the scales
        balanced, (scale, _) = matrix_balance(A, permute=False, separate=True)
    return balanced, scale


def responses(system: Any, points: np.ndarray) -> np.ndarray:
    """C (p - A)^-1 B + D of a system of one input and one output, shape (K,); inf + nan j at a pole."""
    A, B, C, D = (np.asarray(part, dtype=float) for part in (system.A, system.B, system.C, system.D))
    states = states_at(A, B, points)
    values = np.asarray((C @ states)[:, 0, 0] + D[0, 0])
    values[~np.isfinite(states).all(axis=(1, 2))] = complex(np.inf, np.nan)
    return values


def solved_at(matrices: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve stacked equations; NaN where a matrix is singular.

    What is left of them is solved for once more: each is right to rounding of its own terms then, not of
    the largest (Skeel, Math. Comp. 35, 1980), and a small sum of large states keeps its digits.
    """
    found = _solved(matrices, right)
    return found + _solved(matrices, right - matrices @ found)


def _solved(matrices: np.ndarray, right: np.ndarray) -> np.ndarray:
    try:
        return np.asarray(np.linalg.solve(matrices, right))
    except np.linalg.LinAlgError:
        singular = np.array([np.linalg.det(each) == 0 for each in matrices])
        regular = np.where(singular[:, None, None], np.eye(matrices.shape[1]), matrices)
        solved = np.linalg.solve(regular, right)
        solved[singular] = np.nan
        return solved


def refined(
    respond: Callable[[np.ndarray], np.ndarray],
    omega_rad_s: np.ndarray,
    apart: Callable[[np.ndarray], np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and response, halved between neighbours for as long as a figure has them ``apart``."""
    omega, values = omega_rad_s, respond(omega_rad_s)
    for _ in range(HALVED):
        long = apart(values)
        if not long.any() or len(omega) > MOST:
            break
        middle = np.sqrt(omega[1:] * omega[:-1])[long]
        order = np.argsort(np.concatenate([omega, middle]))
        values = np.concatenate([values, respond(middle)])[order]
        omega = np.concatenate([omega, middle])[order]
    return omega, values


def apart_about_minus_one(values: np.ndarray, frame: float) -> np.ndarray:
    """Which neighbours are apart in a Nyquist figure of that half width around -1."""
    near = np.abs(values + 1.0) < 2.5 * frame
    return (np.abs(np.diff(values)) > 0.04 * frame) & (near[1:] | near[:-1])


def apart_in_decibels(values: np.ndarray, span_db: float) -> np.ndarray:
    """Which neighbours are apart in a Nichols chart that goes so far up and down: by 1 dB, or by 7 deg."""
    with np.errstate(all="ignore"):
        shown = np.abs(20.0 * np.log10(np.abs(values))) <= span_db
        return (np.abs(np.log(values[1:] / values[:-1])) > 0.115) & (shown[1:] | shown[:-1])
