"""What the response of a loop of exact polynomials shows, its roots, and what rounding leaves of its gain."""

from dataclasses import replace
from math import fsum

import flint
import numpy as np

from actuator_lti.margins.exact.loop import ExactLoop
from actuator_lti.margins.exact.roots import all_roots
from actuator_lti.margins.given import ULP
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.systems.precision import precision

_EPS = float(np.finfo(float).eps)
_NEAR_DC = 1e-7  # a pole this near to zero frequency may be one that the response does not show
_CLOSE = 1e-3  # a computed eigenvalue this near may be such a pole
_UNSEEN = 1e-9  # what it may move, of the final value, before the rest has settled
_BITS = 256
_LOST = 1e3 * _EPS  # cancellation in c A^-1 b of a state space that leaves no figure


def of_s(p: flint.acb, loop: RationalLoop) -> complex:
    """A pole in the plane of the samples, or itself, where the exact loop has s of z = (1 + s)/(1 - s)."""
    s = complex(p)
    return (1.0 + s) / (1.0 - s) if loop.in_z else s


def shown(exact: ExactLoop, loop: RationalLoop) -> ExactLoop:
    """Without poles of a state space at zero frequency but for rounding that the response does not show.

    In exact numbers such a mode is rarely cancelled: its residue is a rounding error. It is left out where it
    would move the response by less than 1e-9 of its value before the slowest of the others has settled.
    """
    if loop.coefficients is not None or loop.order < 2 or not exact.D.degree():
        return exact
    centre, size = (1.0, 1.0) if loop.in_z else (0.0, _size(loop))
    if float(np.abs(np.linalg.eigvals(loop.A) - centre).min()) > _CLOSE * size:
        return exact
    with precision(_BITS):
        every = [(flint.acb(0), exact.poles.at_zero)] * (exact.D[0] == 0) + all_roots(exact.D)
        near = [p for p, times in every if times == 1 and _off_dc(p, loop) < _NEAR_DC]
        others = [p for p, times in every if not any(p is each for each in near) for _ in range(times)]
        if not near or not others:
            return exact
        values = [of_s(p, loop) for p in others]
        rates = [-np.log(max(abs(p), 1e-9)) if loop.in_z else -p.real for p in values]
        slowest = min((rate for rate in rates if rate > 0.0), default=np.inf)
        scaled = flint.fmpq_poly(exact.N) / exact.D[exact.D.degree()]
        above, residues = flint.acb_poly(flint.arb_poly(scaled)), []
        for k, p in enumerate(near):
            beside = flint.acb_poly.from_roots([*others, *near[k + 1 :]])
            residues.append(above(p) / beside(p))
            above = (above - residues[-1] * beside) // flint.acb_poly([-p, 1])
        below = flint.acb_poly.from_roots(others)
        at_dc = abs(complex(above(0) / below(0))) / (2.0 if loop.in_z else 1.0)  # dz = 2 ds
        most = _UNSEEN * slowest * at_dc
        if any(abs(complex(r)) > most for r in residues):
            return exact
        N, D = _middle(above), _middle(below)
        return replace(
            exact, N=N.numer() * D.denom(), D=D.numer() * N.denom(), degree=exact.degree - len(near)
        )


def _size(loop: RationalLoop) -> float:
    return max(float(np.abs(loop.A).max()), 1e-300)


def _off_dc(p: flint.acb, loop: RationalLoop) -> float:
    """Distance of a pole to zero frequency, in a sampling period or over the entries of A."""
    s = complex(p)
    return abs(2.0 * s / (1.0 - s)) if loop.in_z else abs(s) / _size(loop)


def _middle(p: flint.acb_poly) -> flint.fmpq_poly:
    return flint.fmpq_poly([value.real.mid().fmpq() for value in p.coeffs()])


def near_dc(p: flint.acb, loop: RationalLoop) -> bool:
    """Whether a hidden pole of a state space counts as one at zero frequency."""
    return loop.coefficients is None and _off_dc(p, loop) <= _NEAR_DC


def double(value: flint.fmpq) -> float:
    return int(value.p) / int(value.q)


def dc_noise(loop: RationalLoop) -> float:
    """What the rounding of the entries may move the gain at zero frequency by."""
    x = 1.0 if loop.in_z else 0.0
    if loop.coefficients is not None:
        if not loop.in_z:
            return 0.0  # one coefficient over another
        below = abs(fsum(loop.coefficients[1]))
        return ULP * _EPS * float(np.abs(loop.coefficients[0]).sum()) / below if below else 0.0
    M = x * np.eye(loop.order) - loop.A
    if not loop.order or np.linalg.cond(M) > 1.0 / _LOST:
        return 0.0
    X, Y = np.abs(np.linalg.solve(M, loop.b)), np.abs(np.linalg.solve(M.T, loop.c))
    size = Y @ (x * X + np.abs(loop.A) @ X) + np.abs(loop.c) @ X + Y @ np.abs(loop.b) + abs(loop.d)
    return _LOST * float(size)
