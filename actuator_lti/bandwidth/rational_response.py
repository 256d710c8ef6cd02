"""What a rational response does over frequency, see `DelayResponse`: certified roots, no grid."""

import math
from dataclasses import dataclass

from flint import arb, arb_poly, fmpq, fmpz_poly

from actuator_lti.margins.distances import Distance
from actuator_lti.margins.exact.crossings import smallest
from actuator_lti.margins.exact.real_roots import positive_roots
from actuator_lti.margins.exact.roots import V, split
from actuator_lti.systems.exact_response import double
from actuator_lti.systems.precision import precision

_BITS = 128


@dataclass(frozen=True)
class RationalResponse:
    """H = N/D over w of the s-plane, w = tan(angle/2) for a sampled system; no pole at zero frequency."""

    N: fmpz_poly
    D: fmpz_poly

    @property
    def dc(self) -> fmpq:
        """H at zero frequency, with its sign."""
        return fmpq(self.N[0], self.D[0])

    @property
    def lead(self) -> float:
        """The same in double precision."""
        return double(self.dc)

    def crossings(self, level: float) -> list[float]:
        """Every w > 0 at which |H| passes a level; where it only touches is left out."""
        p, q = level.as_integer_ratio()
        passed = split(self.N).square * (q * q) - split(self.D).square * (p * p)
        return [float(w.mid()) for w, _ in _passages(passed)]

    def smallest(self, distance: Distance) -> tuple[float, float]:
        """Smallest value of a distance over the axis, and where."""
        return smallest(self.N, self.D, distance)

    def first_turn(self, floor: float) -> float | None:
        """Where the phase first falls to 90 deg below that at rest; ``None``: not above the floor."""
        fallen = min(self.crossings(floor), default=math.inf)
        N, D = split(self.N), split(self.D)
        imaginary = N.odd * D.even - N.even * D.odd  # of N conj D, over w
        half_turns, right = 0, True
        for w, v in _passages(N.even * D.even + V * N.odd * D.odd):
            if w > fallen:
                return None
            with precision(_BITS):
                above = bool(arb_poly(imaginary)(v) > 0) == bool(self.dc > 0)
            half_turns += 1 if above == right else -1
            right = not right
            if half_turns < 0:
                return float(w.mid())
        return None


def _passages(p: fmpz_poly) -> list[tuple[arb, arb]]:
    """w and v = w^2 of the positive real roots of odd multiplicity, in order."""
    with precision(_BITS):
        return [(v.sqrt(), v) for v, times in positive_roots(p) if times % 2]
