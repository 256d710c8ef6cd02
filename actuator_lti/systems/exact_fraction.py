"""A rational system as a fraction of two polynomials with exact coefficients: its doubles, as they are."""

from dataclasses import dataclass
from typing import Any

import flint
import numpy as np

from actuator_lti.margins.exact.loop import exact_polynomials, rational
from actuator_lti.margins.exact.roots import all_roots, warped
from actuator_lti.margins.given import ULP, given_of
from actuator_lti.margins.loop import RationalLoop

_EPS = float(np.finfo(float).eps)
_NEAR_DC = 1e-7  # a pole this near to zero frequency may be one that the response does not show
_CLOSE = 1e-3  # a computed eigenvalue this near may be such a pole
_UNSEEN = 1e-9  # what it may move, of the final value, before the rest has settled
_BITS = 256
_LOST = 1e3 * _EPS  # cancellation in c A^-1 b of a state space that leaves no figure


@dataclass(frozen=True)
class Fraction:
    """num/den in lowest terms, lowest power of s or z first, and the denominator before it was cancelled."""

    num: flint.fmpq_poly
    den: flint.fmpq_poly
    whole_den: flint.fmpq_poly

    def warped(self) -> tuple[flint.fmpq_poly, flint.fmpq_poly]:
        """Both in s of z = (1 + s)/(1 - s): the unit circle becomes the imaginary axis."""
        n = self.den.degree()
        return warped(self.num, n), warped(self.den, n)


def exact_fraction(system: Any) -> Fraction:
    """Find the transfer function of a StateSpace or TransferFunction, SISO, without a rounding."""
    num, den = (flint.fmpq_poly(p) for p in exact_polynomials(given_of(system)))
    common = num.gcd(den)
    return Fraction(num / common, den / common, den) if num != 0 else Fraction(num, flint.fmpq_poly([1]), den)


def roots(p: flint.fmpq_poly) -> list[tuple[flint.acb, int]]:
    """Every root, isolated, with its multiplicity; real ones have no imaginary part at all."""
    zeros = next((k for k, c in enumerate(p.coeffs()) if c != 0), 0)
    return [(flint.acb(0), zeros)] * bool(zeros) + all_roots(p.numer())


def divided(p: flint.acb_poly, at: flint.acb) -> flint.acb_poly:
    """p over x - at, the remainder left out."""
    quotient, carried = [], flint.acb(0)
    for value in reversed(p.coeffs()):
        carried = value + at * carried
        quotient.append(carried)
    return flint.acb_poly(quotient[-2::-1])


def balls(p: flint.fmpq_poly) -> flint.acb_poly:
    """The same in balls of the working precision."""
    return flint.acb_poly(flint.arb_poly(p))


def shown(f: Fraction, loop: RationalLoop) -> Fraction:
    """Without poles of a state space at zero frequency but for rounding that the response does not show.

    In exact numbers such a mode is rarely cancelled: its residue is a rounding error. It is left out where it
    would move the response by less than 1e-9 of its value before the slowest of the others has settled.
    """
    if loop.coefficients is not None or loop.order < 2:
        return f
    if _nearest_dc(np.linalg.eigvals(loop.A), loop) > _CLOSE:
        return f
    with flint.ctx.workprec(_BITS):
        every = roots(f.den)
        near = [p for p, times in every if times == 1 and _nearest_dc(complex(p), loop) < _NEAR_DC]
        others = [p for p, times in every if not any(p is each for each in near) for _ in range(times)]
        if not near or not others:
            return f
        rates = [-np.log(max(abs(complex(p)), 1e-9)) if loop.in_z else -complex(p).real for p in others]
        slowest = min((rate for rate in rates if rate > 0.0), default=np.inf)
        above, residues = balls(f.num / f.den[f.den.degree()]), []
        for k, p in enumerate(near):
            beside = flint.acb_poly.from_roots([*others, *near[k + 1 :]])
            residues.append(above(p) / beside(p))
            above = divided(above - residues[-1] * beside, p)
        below, dc = flint.acb_poly.from_roots(others), flint.acb(1 if loop.in_z else 0)
        size = abs(complex(above(dc) / below(dc)))
        if any(abs(complex(r)) > _UNSEEN * slowest * size for r in residues):
            return f
        return Fraction(_middle(above), _middle(below), f.whole_den)


def _nearest_dc(p: Any, loop: RationalLoop) -> float:
    """Smallest distance to zero frequency, in a sampling period or over the entries of A."""
    if loop.in_z:
        return float(np.abs(p - 1.0).min())
    return float(np.abs(p).min()) / max(float(np.abs(loop.A).max()), 1e-300)


def _middle(p: flint.acb_poly) -> flint.fmpq_poly:
    def exact(value: flint.arb) -> flint.fmpq:
        mantissa, exponent = value.mid().man_exp()
        return flint.fmpq(mantissa) * flint.fmpq(2) ** int(exponent)

    return flint.fmpq_poly([exact(value.real) for value in p.coeffs()])


def near_dc(p: flint.acb, loop: RationalLoop) -> bool:
    """Whether a hidden pole of a state space counts as one at zero frequency."""
    return loop.coefficients is None and _nearest_dc(complex(p), loop) <= _NEAR_DC


def double(value: flint.fmpq) -> float:
    """The nearest double."""
    return int(value.p) / int(value.q)


def exact_sum(values: np.ndarray) -> float:
    """Sum without a rounding but the last."""
    return double(sum((rational(v) for v in values), flint.fmpq(0)))


def dc_noise(loop: RationalLoop) -> float:
    """What the rounding of the entries may move the gain at zero frequency by."""
    x = 1.0 if loop.in_z else 0.0
    if loop.coefficients is not None:
        if not loop.in_z:
            return 0.0  # one coefficient over another
        below = abs(exact_sum(loop.coefficients[1]))
        return ULP * _EPS * float(np.abs(loop.coefficients[0]).sum()) / below if below else 0.0
    M = x * np.eye(loop.order) - loop.A
    if not loop.order or np.linalg.cond(M) > 1.0 / _LOST:
        return 0.0
    X, Y = np.abs(np.linalg.solve(M, loop.b)), np.abs(np.linalg.solve(M.T, loop.c))
    size = Y @ (x * X + np.abs(loop.A) @ X) + np.abs(loop.c) @ X + Y @ np.abs(loop.b) + abs(loop.d)
    return _LOST * float(size)
