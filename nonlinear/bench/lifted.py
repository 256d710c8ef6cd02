"""The response of a system over one base period, of M updates at a place, to a sine there; and its errors."""

import numpy as np
import numpy.typing as npt

from actuator_lti.systems.resolvent import balanced, solved_at
from actuator_lti.types import Complexes, Floats

EPS = float(np.finfo(float).eps)
GRID = np.geomspace(1e-4, 0.98, 60) * np.pi  # rad a sample: where responses are compared
FAINT = 1e-6  # of the dominant part of a response: below that it is judged by that part


def even(A: Floats, B: Floats, C: Floats) -> tuple[Floats, Floats, Floats]:
    """The same system with states of like size, which what follows is meant for."""
    A, scale = balanced(A)
    return A, B / scale[:, None], C * scale


def without_rest(A: Floats, errors: Floats, most: int) -> tuple[Floats, Floats]:
    """A with states of like size and without modes at rest, ``most`` at the most; and errors of its entries.

    One is a v with A v = v within ``errors``, those of A: an angle that nothing holds, a torque that an
    integral and a spring hold.  Then x - v x_j, v_j = 1, obeys equations without x_j.
    """
    for left in range(most, -1, -1):
        A, scale = balanced(A)
        errors = errors / scale[:, None] * scale
        if left == 0 or len(A) < 2:
            break
        own, size = np.eye(len(A)), len(A) * EPS * np.max(np.abs(A), axis=1, initial=1.0)
        v, allowed = _at_rest(A - own, errors, size)
        j = int(np.argmax(np.abs(v)))
        if (np.abs((A - own) @ v) > allowed).any():
            break
        o = np.arange(len(v)) != j
        errors = (errors + np.outer(np.abs(v), errors[j]))[np.ix_(o, o)]
        A = (A - np.outer(v, A[j]))[np.ix_(o, o)]
    return A, errors


def _at_rest(turned: Floats, errors: Floats, size: Floats) -> tuple[Floats, Floats]:
    """The v, largest part 1, that A - 1 makes least of by what is allowed of each row; what that is."""
    # an integrator's row is known to rounding, a bent load's to the errors of its columns
    v, allowed = np.zeros(len(turned)), np.ones(len(turned))
    for _ in range(3):
        v = _nearest_to_rest(turned / allowed[:, None])
        v /= v[int(np.argmax(np.abs(v)))]
        allowed = errors @ np.abs(v) + size
    return v, allowed


def _nearest_to_rest(turned: Floats) -> Floats:
    """The v that A - 1 makes least of, refined once: rounding of its largest row is felt in the faintest."""
    left, sizes, right = np.linalg.svd(turned)
    off, known = left.T @ (turned @ right[-1]), sizes > len(sizes) * EPS * sizes[0]
    known[-1] = False
    return np.asarray(right[-1] - (off[known] / sizes[known]) @ right[known])


def eigenvalues(A: Floats, errors: Floats) -> tuple[Complexes, Floats, Floats]:
    """Those of A, what errors of its entries do to each, and 1 over the condition number of each."""
    from scipy.linalg import eig

    found, left, right = eig(A, left=True)
    sharp = np.maximum(np.abs(np.sum(left.conj() * right, axis=0)), np.finfo(float).tiny)  # of unit vectors
    return found, np.einsum("ik,ij,jk->k", np.abs(left), errors, np.abs(right)) / sharp, sharp


def lifted(A: Floats, B: Floats, C: Floats, D: Floats, points: Complexes) -> Complexes:
    """C (p - A)^-1 B + D at points p = exp(j w period_s), shape (K, M, M).

    What is left where large terms cancel is right to the rounding of the entries, so that a faint response
    has as many digits as they give it.
    """
    return np.asarray(C @ solved_at(points.reshape(-1, 1, 1) * np.eye(len(A)) - A, B) + D)


def response(A: Floats, B: Floats, C: Floats, D: Floats, z: Complexes) -> Complexes:
    """The fundamental of a lifted system at points of the faster rate, shape of z."""
    M = B.shape[1]
    turn = z.reshape(-1, 1) ** np.arange(M)
    whole = lifted(A, B, C, D, z.reshape(-1) ** M)
    return np.asarray(np.einsum("kj,kjm,km->k", 1.0 / turn, whole, turn) / M).reshape(z.shape)


def sensitivities(A: Floats, B: Floats, C: Floats, D: Floats, z: Complexes) -> tuple[Complexes, Complexes]:
    """What an entry (i, k) of A over C beside B over D does to the fundamental at z: left_i right_k."""
    A, scale = balanced(A)
    B, C = B / scale[:, None], C * scale
    M, n = B.shape[1], len(A)
    turned = z.reshape(-1, 1, 1) ** M * np.eye(n) - A
    turn = z.reshape(-1, 1) ** np.arange(M)
    back = 1.0 / (turn * M)
    right = np.linalg.solve(turned, (turn @ B.T)[:, :, None])[:, :, 0]
    left = np.linalg.solve(turned.transpose(0, 2, 1), (back @ C)[:, :, None])[:, :, 0]
    return np.concatenate([left / scale, back], axis=1), np.concatenate([right * scale, turn], axis=1)


def relative(found: npt.ArrayLike, wanted: npt.ArrayLike) -> Floats:
    """Difference over size, see `sized`."""
    return np.asarray(np.abs(np.asarray(found) - wanted) / sized(wanted))


def sized(response: npt.ArrayLike) -> Floats:
    """Size of a response, of a faint part of it that of its dominant part in part."""
    size = np.abs(response)
    return np.asarray(size + FAINT * np.max(size, initial=1e-300))
