"""(p - A)^-1 B and C (p - A)^-1 B + D at many complex points p: s = jw, or z = exp(jwT)."""

from typing import Any

import numpy as np

_ENTRIES = 1 << 15  # of the matrices solved in one call: what the cache holds


def states_at(A: np.ndarray, B: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(p - A)^-1 B, shape (K, n, m), for A (n, n), B (n, m) and points (K,); NaN at a pole.

    The states are scaled by powers of two first: of ones of very different size a small response, behind a
    soft spring say, would keep few digits.
    """
    A, scale = balanced(A)
    B = B / scale[:, None]
    result = np.empty((len(points), *B.shape), dtype=complex)
    own = np.arange(len(A))
    some = max(_ENTRIES // max(A.size, 1), 1)  # points at once
    for start in range(0, len(points), some):
        part = slice(start, start + some)
        matrix = np.repeat(-A.astype(complex)[None], len(points[part]), axis=0)
        matrix[:, own, own] += points[part, None]
        result[part] = solved_at(matrix, np.broadcast_to(B, (len(matrix), *B.shape)))
    return result * scale[:, None]


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
    """Solve stacked equations; NaN where a matrix is singular."""
    try:
        return np.linalg.solve(matrices, right)
    except np.linalg.LinAlgError:
        singular = np.array([np.linalg.det(each) == 0 for each in matrices])
        regular = np.where(singular[:, None, None], np.eye(matrices.shape[1]), matrices)
        solved = np.linalg.solve(regular, right)
        solved[singular] = np.nan
        return solved
