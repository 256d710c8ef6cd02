"""Smallest distance of an exact loop to -1: every stationary point, from certified roots."""

from __future__ import annotations

import math

from flint import arb, ctx, fmpz_poly

from actuator_lti.errors import NumericalError
from actuator_lti.margins.distances import Distance
from actuator_lti.margins.exact.loop import ExactLoop
from actuator_lti.margins.exact.roots import all_roots, positive_roots, split

_FIRST_BITS, _MOST_BITS = 96, 1 << 14
_ZERO = 1e-18


def smallest(loop: ExactLoop, distance: Distance) -> tuple[float, float]:
    """Smallest value of a distance and its w."""
    above, below = distance.over(loop.N, loop.D)
    return least(split(above).square, split(below).square)


def least(above: fmpz_poly, below: fmpz_poly) -> tuple[float, float]:
    """Smallest sqrt(above/below) over v >= 0, infinity included, and w = sqrt(v)."""
    if below.degree() < 0:
        return math.inf, 0.0
    candidates = [(_ratio(above, below, lowest=True), 0.0), (_ratio(above, below, lowest=False), math.inf)]
    slope = above.derivative() * below - above * below.derivative()
    bits = _FIRST_BITS
    while bits <= _MOST_BITS:
        with ctx.workprec(bits):
            places = [v for v, _ in positive_roots(all_roots(slope))]
            values = [above(v) / below(v) for v in places]
            if all(_settled(value) for value in values):
                stationary = [
                    (math.sqrt(max(float(value.mid()), 0.0)), float(v.sqrt().mid()))
                    for value, v in zip(values, places, strict=True)
                    if value.is_finite()
                ]
                value, w = min([*candidates, *stationary])
                return (value, w) if value > _ZERO else (0.0, w)
        bits *= 2
    raise NumericalError("the smallest distance to -1 could not be determined")


def _settled(value: arb) -> bool:
    return value.rel_accuracy_bits() >= 53 or not value.is_finite() or float(value.abs_upper()) < _ZERO**2


def _ratio(above: fmpz_poly, below: fmpz_poly, lowest: bool) -> float:
    if above.degree() < 0:
        return 0.0
    k, m = (_lowest(above), _lowest(below)) if lowest else (-above.degree(), -below.degree())
    if k != m:
        return 0.0 if k > m else math.inf
    return float((arb(above[abs(k)]) / arb(below[abs(m)])).sqrt())


def _lowest(p: fmpz_poly) -> int:
    return next(k for k in range(p.degree() + 1) if p[k] != 0)
