"""Poles and zeros of a rational loop, and the phase of each factor."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigvals

from actuator_lti.margins.loop import Complex, RationalLoop, Real
from actuator_lti.margins.poles import eigenvalues

_INFINITE = 1e12


def zeros(loop: RationalLoop) -> Complex:
    """Finite zeros of L: generalised eigenvalues of the system matrix (for coefficients: their roots)."""
    if loop.numerator is not None:
        return np.roots(np.trim_zeros(loop.numerator, "f")).astype(complex)
    n = loop.order
    if not n:
        return np.empty(0, dtype=complex)
    scale = max(float(np.abs(loop.b).max() * np.abs(loop.c).max()), abs(loop.d), 1e-300) ** 0.5
    M, N = np.zeros((n + 1, n + 1)), np.eye(n + 1)
    M[:n, :n], M[:n, n], M[n, :n], M[n, n] = loop.A, loop.b / scale, loop.c / scale, loop.d / scale**2
    N[n, n] = 0.0
    alpha, beta = eigvals(M, N, homogeneous_eigvals=True)
    size = max(float(np.abs(loop.A).max()), 1.0)
    finite = np.abs(beta) * _INFINITE * size > np.abs(alpha)
    result = alpha[finite] / beta[finite]
    return result[: max(n if loop.d else n - 1, 0)] if result.size > n else result


def poles(loop: RationalLoop) -> Complex:
    """Poles of L."""
    return eigenvalues(loop.A)


def factor_phase(roots: Complex, x: Real, in_z: bool) -> Real:
    """Sum of the phases of the factors (s - a) or (z - a), each continuous in x and zero at x = 0, rad.

    A factor of a root at zero frequency itself starts at 90 deg; a root on the border turns by 180 deg as
    the limit of a stable one. The sign of the product at zero frequency is left out.
    """
    if not roots.size:
        return np.zeros(x.shape)
    x = x[..., None]
    if in_z:
        return _sampled_phase(roots, x)
    inside = roots.real <= 0.0
    at = np.where(
        inside, np.arctan2(x - roots.imag, np.abs(roots.real)), np.arctan2(roots.imag - x, roots.real)
    )
    start = np.where(inside, np.arctan2(-roots.imag, np.abs(roots.real)), np.arctan2(roots.imag, roots.real))
    at = np.where(roots == 0.0, 0.5 * np.pi, at - start)
    return at.sum(axis=-1)


def _sampled_phase(roots: Complex, x: Real) -> Real:
    inside = np.abs(roots) <= 1.0
    safe = np.where(inside, 2.0, roots)
    at = np.where(
        inside,
        x + np.angle(1.0 - np.where(inside, roots, 0.0) * np.exp(-1j * x)),
        np.angle(1.0 - np.exp(1j * x) / safe),
    )
    start = np.where(inside, np.angle(1.0 - np.where(inside, roots, 0.0)), np.angle(1.0 - 1.0 / safe))
    at = np.where(roots == 1.0, 0.5 * np.pi + 0.5 * x, at - start)
    return at.sum(axis=-1)
