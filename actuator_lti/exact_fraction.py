"""A rational system as a fraction of two polynomials with exact coefficients: its doubles, as they are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import flint
import numpy as np

from actuator_lti.margins.certified_roots import all_roots
from actuator_lti.margins.exact_loop import exact_polynomials, warped
from actuator_lti.margins.given import ULP, given_of
from actuator_lti.margins.loop import RationalLoop

_EPS = float(np.finfo(float).eps)
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


def rational(value: Any) -> flint.fmpq:
    """A double as the rational number that it is."""
    return flint.fmpq(*float(value).as_integer_ratio())


def double(value: flint.fmpq) -> float:
    """The nearest double."""
    return int(value.p) / int(value.q)


def exact_sum(values: np.ndarray) -> float:
    """Sum without a rounding but the last."""
    return double(sum((rational(v) for v in values), flint.fmpq(0)))


def dc_noise(loop: RationalLoop) -> float:
    """What the rounding of the entries may move the gain at zero frequency by."""
    x = 1.0 if loop.in_z else 0.0
    if loop.numerator is not None and loop.denominator is not None:
        if not loop.in_z:
            return 0.0  # one coefficient over another
        below = abs(exact_sum(loop.denominator))
        return ULP * _EPS * float(np.abs(loop.numerator).sum()) / below if below else 0.0
    M = x * np.eye(loop.order) - loop.A
    if not loop.order or np.linalg.cond(M) > 1.0 / _LOST:
        return 0.0
    X, Y = np.abs(np.linalg.solve(M, loop.b)), np.abs(np.linalg.solve(M.T, loop.c))
    size = Y @ (x * X + np.abs(loop.A) @ X) + np.abs(loop.c) @ X + Y @ np.abs(loop.b) + abs(loop.d)
    return _LOST * float(size)
