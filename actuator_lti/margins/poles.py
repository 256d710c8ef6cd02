"""Poles sorted by the stability boundary, each with the accuracy that its eigenvalue has."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgeev

from actuator_lti.errors import NumericalError
from actuator_lti.types import Complex, Ints, Mask, Real

_EPS = float(np.finfo(float).eps)
_SHARP = 1e-3  # a pole at the limit's error, over its modulus
_SAFE = 10.0


@dataclass(frozen=True)
class SortedPoles:
    values: Complex  # (n,): all of them
    unstable: int  # how many lie strictly outside the stable region
    at_limit: int = 0  # how many lie at the limit as far as double precision can tell
    at_dc: int = 0  # how many of these lie at zero frequency
    # some pole, other than those at zero frequency, may lie on either side of the stability boundary
    doubtful: bool = False


def eigenvalues(A: Real) -> Complex:
    if not A.size:
        return np.empty(0, dtype=complex)
    return _eigen(A, vectors=False)[0]


def polynomial_roots(p: Real) -> Complex:
    """Roots of a polynomial (highest power first), as eigenvalues; those at zero exactly."""
    used = p.nonzero()[0]
    if not used.size:
        return np.empty(0, dtype=complex)
    inner = p[used[0] : used[-1] + 1]
    n = inner.size - 1
    companion = np.zeros((n, n))
    if n:
        companion.flat[n :: n + 1] = 1.0
        companion[0] = -inner[1:] / inner[0]
    return np.concatenate((eigenvalues(companion), np.zeros(p.size - 1 - used[-1])))


def sorted_poles(A: Real, in_z: bool) -> SortedPoles:
    """Sort the eigenvalues of A (balanced) by the imaginary axis, or the unit circle, see `all_sorted`."""
    return all_sorted((A,), in_z)[0]


def all_sorted(matrices: Sequence[Real], in_z: bool) -> list[SortedPoles]:
    """Sort the eigenvalues of matrices of one size (balanced).

    The error of an eigenvalue is bounded by 10 n eps (|v|* |A| |w|) / |v* w| with the left and right
    eigenvectors v and w, entry by entry. It is at the stability limit where that bound reaches it and is much
    smaller than its modulus (at zero frequency: than that of the next one). Where the bound reaches the
    limit and is not small, the eigenvalue is simply not determined.
    """
    if not matrices[0].size:
        return [SortedPoles(np.empty(0, dtype=complex), 0)] * len(matrices)
    values, radius = _with_error_bounds(matrices)
    centre = 1.0 if in_z else 0.0
    distance: Real = np.abs(values) - 1.0 if in_z else values.real
    radius[values == centre] = 0.0
    near = np.abs(distance) <= _SAFE * radius
    found = (_sorted(*each, centre) for each in zip(values, radius, distance, near, strict=True))
    return [_by_parts(A, in_z, one) if one.doubtful else one for A, one in zip(matrices, found, strict=True)]


def diagonal_blocks(A: Real) -> list[Ints]:
    """States that act upon each other, directly or not: those of a chain of delays act one way alone."""
    n = len(A)
    reached = np.eye(n) + (A != 0.0)
    for _ in range(n.bit_length()):  # twice as many steps each time
        reached = np.sign(reached @ reached)
    first = (reached * reached.T).argmax(axis=1)
    return [np.flatnonzero(first == k) for k in np.unique(first)]


def _by_parts(A: Real, in_z: bool, whole: SortedPoles) -> SortedPoles:
    """The same by the blocks on the diagonal, if there are several: what is zero beside them is so exactly.

    Each state of a chain of delays is such a block; together they are one defective eigenvalue.
    """
    if len(blocks := diagonal_blocks(A)) == 1:
        return whole
    parts = [all_sorted((A[np.ix_(own, own)],), in_z)[0] for own in blocks]
    unstable, at_limit, at_dc = np.sum([(part.unstable, part.at_limit, part.at_dc) for part in parts], axis=0)
    values, doubtful = np.concatenate([p.values for p in parts]), any(p.doubtful for p in parts)
    return SortedPoles(values, int(unstable), int(at_limit), int(at_dc), doubtful)


def _sorted(values: Complex, radius: Real, distance: Real, near: Mask, centre: float) -> SortedPoles:
    if not near.any():
        return SortedPoles(values, int(np.count_nonzero(distance > 0.0)))
    size = np.abs(values - centre)
    beyond = [size[size > 10.0 * max(r, s)].min(initial=np.inf) for r, s in zip(radius, size, strict=True)]
    next_size = np.where(np.isinf(beyond), 0.0, beyond)
    placed = radius <= _SHARP * np.where(size > radius, np.abs(values), next_size)
    at_limit = (np.abs(distance) <= radius) & placed
    unstable = int(np.count_nonzero((distance > 0.0) & ~at_limit))
    at_dc = int(np.count_nonzero(at_limit & (size <= 2.0 * radius)))
    doubtful = bool(near[values != centre].any())
    return SortedPoles(values, unstable, int(np.count_nonzero(at_limit)), at_dc, doubtful)


def _with_error_bounds(matrices: Sequence[Real]) -> tuple[Complex, Real]:
    """Eigenvalues sharpened by a Rayleigh quotient v* A w / v* w, and their bounds from v* abs(A) w."""
    every, left, right = zip(*(_eigen(A, vectors=True) for A in matrices), strict=True)
    A, values = np.array(matrices), np.array(every)
    V, W = _complex_vectors(np.array((left, right)), values.imag)
    overlap = (V.conj() * W).sum(axis=-2)
    weight = (np.abs(V) * (np.abs(A) @ np.abs(W))).sum(axis=-2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # left and right nearly apart
        radius = 10.0 * values.shape[-1] * _EPS * weight / np.abs(overlap)
        sharper = (V.conj() * (A @ W)).sum(axis=-2) / overlap
    radius = np.where(np.isnan(radius), np.inf, radius)
    apart = np.abs(sharper - values)
    good = apart <= np.minimum(10.0 * radius, 1e-3 * np.abs(values))
    # next to zero the bound sees nothing of the error of the vectors: two answers are as sure as they agree
    wide = (apart > 10.0 * radius) & (values != 0.0)
    return np.where(good, sharper, values), np.where(wide, 2.0 * apart, radius)


def _eigen(A: Real, vectors: bool) -> tuple[Complex, Real, Real]:
    """Eigenvalues, left and right eigenvectors as LAPACK packs them; never NaN to LAPACK, which prints."""
    if not np.isfinite(A).all():
        raise NumericalError("the loop overflows double precision: rescale its states")
    re, im, left, right, info = dgeev(A, compute_vl=int(vectors), compute_vr=int(vectors))
    if info:
        raise NumericalError("the poles did not converge: rescale the states of the loop")
    return re + 1j * im, left, right


def _complex_vectors(packed: Real, im: Real) -> Complex:
    """Shape kept, (..., matrices, n, n); of a pair the real part stands in front of the imaginary one."""
    out = packed.astype(complex)
    for of, k in zip(*(place.tolist() for place in (im > 0.0).nonzero()), strict=True):
        out.imag[:, of, :, k] = packed[:, of, :, k + 1]
        out[:, of, :, k + 1] = out[:, of, :, k].conj()
    return out
