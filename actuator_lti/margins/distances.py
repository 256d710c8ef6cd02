"""Distances of a response L whose smallest value is asked for: to -1, and those that peaks are one over."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from actuator_lti.types import Complex, Real

Place = tuple[float, float]  # a smallest distance, and its w


@dataclass(frozen=True)
class Distance:
    """|a L + b| over |c L + e|."""

    a: int
    b: int
    c: int
    e: int

    @cached_property
    def form(self) -> Real:
        """As the compiled search takes it."""
        return np.array((self.a, self.b, self.c, self.e), dtype=float)

    def at(self, L: complex) -> float:
        """Its value; L may be infinite."""
        if abs(L) > 1.0:  # by 1/L
            inner = 1.0 / L if math.isfinite(abs(L)) else 0.0
            return Distance(self.b, self.a, self.e, self.c).at(inner)
        below = abs(self.c * L + self.e)
        return abs(self.a * L + self.b) / below if below else math.inf

    def of(self, L: Complex) -> Real:
        """Its values, L finite."""
        with np.errstate(all="ignore"):
            below: Real = np.abs(self.c * L + self.e)
            return np.asarray(
                np.where((below > 0.0) & (below < np.inf), np.abs(self.a * L + self.b) / below, np.inf)
            )

    def over(self, N: Any, D: Any) -> tuple[Any, Any]:
        """What it is the quotient of, for L = N/D."""
        return self.a * N + self.b * D, self.c * N + self.e * D

    @property
    def at_no_gain(self) -> float:
        return abs(self.b / self.e) if self.e else math.inf

    def below(self, value: Any) -> tuple[Any, Any, Any]:
        """(u, v, w): it is smaller than a value where u abs(L)^2 + v Re L + w < 0."""
        square = value * value
        return (
            self.a * self.a - square * (self.c * self.c),
            2 * (self.a * self.b - square * (self.c * self.e)),
            self.b * self.b - square * (self.e * self.e),
        )

    def gain_above(self, value: float) -> float:
        """A gain below which it is larger than a value, whatever the phase."""
        return (abs(self.b) - value * abs(self.e)) / (abs(self.a) + value * abs(self.c))


MODULUS = Distance(1, 1, 0, 1)
"""|1 + L|, one over |S|."""
DISK = Distance(2, 2, -1, 1)
"""|2 (1 + L)/(1 - L)|, of the balanced disk margin."""
COMPLEMENTARY = Distance(1, 1, 1, 0)
"""|(1 + L)/L|, one over |T|."""
INVERSE = Distance(0, 1, 1, 0)
"""1/|L|, one over the gain."""
