"""Where the gain of a rational system passes a level, and where it is largest: certified roots, no grid."""

from __future__ import annotations

import math
from dataclasses import dataclass

import flint

from actuator_lti.margins.exact.crossings import least
from actuator_lti.margins.exact.roots import all_roots, even_and_odd, positive_roots
from actuator_lti.systems.exact_fraction import Fraction, double

_BITS = 128
_V = flint.fmpq_poly([0, 1])


@dataclass(frozen=True)
class ExactGain:
    """|H|^2 over v = w^2, a fraction of two polynomials; w = tan(angle/2) for a sampled system."""

    above: flint.fmpq_poly  # |num(j w)|^2 and |den(j w)|^2
    below: flint.fmpq_poly
    real: flint.fmpq_poly  # num(j w) conj(den(j w)) = real + j w imag
    imag: flint.fmpq_poly
    dc: flint.fmpq  # H at zero frequency, with its sign

    def crossings(self, level_squared: float) -> list[float]:
        """Every w > 0 at which |H| passes sqrt(level_squared) |H(0)|; where it only touches is left out."""
        level = flint.fmpq(*level_squared.as_integer_ratio()) * self.dc * self.dc
        with flint.ctx.workprec(_BITS):
            return [_root(v) for v, times in _positive_roots(self.above - level * self.below) if times % 2]

    def largest(self) -> tuple[float, float]:
        """Largest |H|/|H(0)| and its w: 0 where that is zero frequency, infinity at the other end."""
        above, below = self.above.numer() * self.below.denom(), self.below.numer() * self.above.denom()
        value, w = least(below, above)
        return (1.0 / value if value else math.inf) / abs(double(self.dc)), w

    def first_turn(self, floor_squared: float) -> float | None:
        """w at which the phase first falls below -90 deg against zero frequency.

        Followed as long as |H| is above sqrt(floor_squared) |H(0)|; ``None``: not until then.
        """
        fades = self.crossings(floor_squared)
        half_turns, right = 0, True
        with flint.ctx.workprec(_BITS):
            for v, times in _positive_roots(self.real):
                w = _root(v)
                if fades and w > fades[0]:
                    return None
                if times % 2 == 0:
                    continue
                above = bool(flint.arb_poly(self.imag)(v) > 0) == bool(self.dc > 0)
                half_turns += 1 if above == right else -1
                right = not right
                if half_turns < 0:
                    return w
        return None


def exact_gain(fraction: Fraction, sampled: bool) -> ExactGain | None:
    """Bring a transfer function into this form; ``None``: a pole at zero frequency."""
    num, den = fraction.warped() if sampled else (fraction.num, fraction.den)
    if den[0] == 0:
        return None
    (a, b), (c, d) = even_and_odd(num), even_and_odd(den)  # (a + j w b)/(c + j w d)
    return ExactGain(
        a * a + _V * b * b, c * c + _V * d * d, a * c + _V * b * d, b * c - a * d, num[0] / den[0]
    )


def _positive_roots(p: flint.fmpq_poly) -> list[tuple[flint.arb, int]]:
    """Positive real roots with their multiplicities, in order."""
    return positive_roots(all_roots(p.numer()))


def _root(v: flint.arb) -> float:
    return float(v.sqrt().mid())
