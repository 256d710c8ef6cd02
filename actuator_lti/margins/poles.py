"""Poles sorted by the border of stability, each with the accuracy that its eigenvalue has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgeev

from actuator_lti.errors import NumericalError
from actuator_lti.margins.loop import Complex, Mask, Real

_EPS = float(np.finfo(float).eps)
_SHARP = 1e-3  # a border pole's error, over its modulus
_SAFE = 10.0
_SCATTER = 1.0
_MOST_INTEGRATORS = 6


@dataclass(frozen=True)
class BorderPole:
    """A pole on the border of stability, with its multiplicity; x >= 0 as in `RationalLoop`."""

    x: float
    multiplicity: int


@dataclass(frozen=True)
class SortedPoles:
    """Poles of a system by the border of stability.

    Attributes
    ----------
    values : array (n,), complex
        All of them.
    unstable : int
        How many lie strictly outside the stable region.
    border : tuple of BorderPole
        Those on the border as far as double precision can tell, x >= 0 (conjugates left out).
    border_count : int
        How many these are, conjugates counted.
    doubtful : bool
        Some pole, other than those at zero frequency, may lie on either side of the border.
    """

    values: Complex
    unstable: int
    border: tuple[BorderPole, ...]
    border_count: int = 0
    doubtful: bool = False

    @property
    def at_dc(self) -> int:
        """Multiplicity of the pole at zero frequency."""
        return sum(pole.multiplicity for pole in self.border if pole.x == 0.0)


def eigenvalues(A: Real) -> Complex:
    """Eigenvalues of a real matrix."""
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


def sorted_poles(A: Real, in_z: bool, gather: bool = False) -> SortedPoles:
    """Sort the eigenvalues of A (balanced) by the border of stability.

    The error of an eigenvalue is bounded by 10 n eps (|v|* |A| |w|) / |v* w| with the left and right
    eigenvectors v and w, entry by entry. It is on the border where that bound reaches the border and is much
    smaller than its modulus (at zero frequency: than that of the next one). Where the bound reaches the
    border and is not small, the eigenvalue is simply not determined.

    Parameters
    ----------
    A : array (n, n)
        State matrix.
    in_z : bool
        The border is the unit circle, not the imaginary axis.
    gather : bool
        Take eigenvalues as close to zero frequency as a multiple pole there is scattered by rounding for
        that pole (for open loops, where nothing else hangs on it).
    """
    if not A.size:
        return SortedPoles(np.empty(0, dtype=complex), 0, ())
    values, radius = _with_error_bounds(A)
    centre = 1.0 if in_z else 0.0
    if gather:
        values, radius = _gathered(values, radius, float(np.abs(A).max()), in_z)
    distance: Real = np.abs(values) - 1.0 if in_z else values.real
    radius[values == centre] = 0.0
    if not (np.abs(distance) <= _SAFE * radius).any():
        return SortedPoles(values, int(np.count_nonzero(distance > 0.0)), ())
    size = np.abs(values - centre)
    on_border = (np.abs(distance) <= radius) & _placed(values, radius, size)
    if gather:
        scattered = on_border & (size <= 2.0 * radius)
        values[scattered], radius[scattered] = centre, 0.0
    unstable = int(np.count_nonzero((distance > 0.0) & ~on_border))
    border = _clusters(values, radius, on_border, in_z)
    doubtful = bool((np.abs(distance) <= _SAFE * radius)[values != centre].any())
    return SortedPoles(values, unstable, border, int(np.count_nonzero(on_border)), doubtful)


def _placed(values: Complex, radius: Real, size: Real) -> Mask:
    """Whether each error is much smaller than the modulus, at zero frequency than that of the next pole."""
    beyond = [size[size > 10.0 * max(r, s)].min(initial=np.inf) for r, s in zip(radius, size, strict=True)]
    next_size = np.where(np.isinf(beyond), 0.0, beyond)
    placed: Mask = radius <= _SHARP * np.where(size > radius, np.abs(values), next_size)
    return placed


def _gathered(values: Complex, radius: Real, norm: float, in_z: bool) -> tuple[Complex, Real]:
    """Put the eigenvalues of a multiple pole at zero frequency there.


    A defective eigenvalue of multiplicity m is scattered by about (eps norm)^(1/m) next^((m - 1)/m), with
    the distance ``next`` to the next eigenvalue.
    """
    centre = 1.0 if in_z else 0.0
    distance = np.abs(values - centre)
    order = distance.argsort()
    for m in range(min(_MOST_INTEGRATORS, values.size), 0, -1):
        beyond = float(distance[order[m]]) if m < values.size else norm
        farthest = float(distance[order[m - 1]])
        scatter = _SCATTER * (_EPS * norm) ** (1.0 / m) * beyond ** (1.0 - 1.0 / m)
        if farthest <= (scatter if m > 1 else radius[order[0]]) and farthest <= 1e-6 * beyond:
            values, radius = values.copy(), radius.copy()
            values[order[:m]], radius[order[:m]] = centre, 0.0
            break
    return values, radius


def _with_error_bounds(A: Real) -> tuple[Complex, Real]:
    """Eigenvalues sharpened by a Rayleigh quotient v* A w / v* w, and their bounds from v* abs(A) w."""
    values, left, right = _eigen(A, vectors=True)
    V, W = _complex_vectors(np.array((left, right)), values.imag)
    overlap = (V.conj() * W).sum(axis=0)
    weight = (np.abs(V) * (np.abs(A) @ np.abs(W))).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # left and right nearly apart
        radius = 10.0 * values.size * _EPS * weight / np.abs(overlap)
        sharper = (V.conj() * (A @ W)).sum(axis=0) / overlap
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
    out = packed.astype(complex)
    k = (im > 0.0).nonzero()[0]
    if k.size:
        pairs = packed[..., k] + 1j * packed[..., k + 1]
        out[..., k], out[..., k + 1] = pairs, pairs.conj()
    return out


def _clusters(values: Complex, radius: Real, on_border: Mask, in_z: bool) -> tuple[BorderPole, ...]:
    """Group the border poles of the upper half plane; a group at 0 or pi keeps all of its members."""
    x = np.abs(np.angle(values[on_border])) if in_z else np.abs(values[on_border].imag)
    r = radius[on_border]
    order = np.argsort(x)
    groups: list[list[int]] = []
    for k in order:
        if groups and x[k] - x[groups[-1][-1]] <= 2.0 * (r[k] + r[groups[-1][-1]]):
            groups[-1].append(int(k))
        else:
            groups.append([int(k)])
    out = []
    for group in groups:
        centre, width = float(np.mean(x[group])), float(np.max(r[group]))
        if centre <= 2.0 * width:
            out.append(BorderPole(0.0, len(group)))
        elif in_z and np.pi - centre <= 2.0 * width + 4.0 * _EPS:
            out.append(BorderPole(float(np.pi), len(group)))
        else:
            out.append(BorderPole(centre, max(len(group) // 2, 1)))
    return tuple(out)
